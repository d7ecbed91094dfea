# SPDX-License-Identifier: Apache-2.0
"""From the button to the imported result, in a real window, and over Blender's death."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from window import play

from rfgs_core.dataset import open_dataset

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent


def test_a_job_runs_from_the_button_to_the_import(
    blender, programs: tuple[Path, Path], tiny_blend: Path, tmp_path: Path
) -> None:
    pictures = tmp_path / "pictures"
    first = play(
        *(blender, HERE / "play_jobs.py", tiny_blend, pictures, *programs, tmp_path),
        size=(1400, 1500),
        timeout=1200,
    )
    assert first.returncode == -9, first.stdout[-3000:] + first.stderr[-3000:]
    assert "Traceback" not in first.stdout + first.stderr
    told = json.loads((pictures / "told.json").read_text())
    assert told["clouds"] == [60] * 4, "a cloud per frame, and none for an empty static set"
    assert told["undone"] == [] and told["redone"] == told["clouds"]
    # A job takes every core, and without a GPU drawing needs one: most waits are short still.
    assert len(told["gaps_s"]) > 20 and np.median(told["gaps_s"]) < 1.0, told["gaps_s"]

    second = play(
        *(blender, HERE / "play_restart.py", tiny_blend, pictures, *programs),
        size=(1400, 1500),
        timeout=900,
    )
    assert second.returncode == 0, second.stdout[-3000:] + second.stderr[-3000:]
    whole, resumed = tmp_path / "dataset", tmp_path / "cut_off"
    assert open_dataset(resumed).sequence().frames == [1, 2, 3, 4]
    assert described(resumed) == described(whole), "resumed to the same bytes"


def described(dataset: Path) -> tuple[list[str], dict]:
    """Checksums and description; the file was saved between the two datasets."""
    lines = (dataset / "MANIFEST.sha256").read_text().splitlines()
    sequence = json.loads((dataset / "tiny" / "sequence.json").read_text())
    del sequence["blend_sha256"]
    return [line for line in lines if not line.endswith("sequence.json")], sequence
