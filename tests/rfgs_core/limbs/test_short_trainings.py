# SPDX-License-Identifier: Apache-2.0
"""Trainings of the network of limbs that end before its first step."""

from __future__ import annotations

from pathlib import Path

import pytest

from rfgs_core.cli import main
from rfgs_core.limbs import learn as learning
from rfgs_core.limbs.learn import LearnConfig, learn
from rfgs_core.radio.presets import preset


@pytest.mark.parametrize(
    ("options", "least"),
    [
        ("--frames 2", 2048),
        ("--frames 63 --kept 8", 64),
        ("--frames 64 --kept 64 --passes 0.5", 128),
        ("--frames 100 --kept 64 --batch 128", 128),
    ],
)
def test_too_few_frames_for_a_step_are_refused(
    options: str, least: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", str(tmp_path / "a.safetensors"), "--workers", "0"]
    assert main(["limbs", "--radio", "wifi", *options.split(), *out]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--frames {options.split()[1]}: expected at least {least}, which the first step" in line
    assert list(tmp_path.iterdir()) == []


def test_a_training_without_a_step_tells_no_error_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learning, "JUDGED", 1)
    said = []
    config = LearnConfig(hours=1e-9, workers=0)
    learn(preset("wifi_commodity"), config, lambda _frames, words: said.append(words))
    assert len(said) == 1
    assert said[0].startswith("in unseen worlds ") and "nan" not in said[0]
