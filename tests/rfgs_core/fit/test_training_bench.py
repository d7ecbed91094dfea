# SPDX-License-Identifier: Apache-2.0
"""The benchmark of training stops where the validation loss stands still, or at its limit."""

from __future__ import annotations

from pathlib import Path

import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.fit import bench


@pytest.mark.usefixtures("coarse_postures")
def test_it_stops_when_the_loss_stands_still(
    tiny_dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "WINDOW", 5)
    monkeypatch.setattr(bench, "LIMIT", 15)
    few = bench.TrainingBench(gaussians=40)
    # Any change counts as standing still, or none does.
    monkeypatch.setattr(bench, "STILL", 1e9)
    eager = bench.bench_training(tiny_dataset, "wifi", None, few)
    assert eager["still"] and eager["steps"] == 5
    monkeypatch.setattr(bench, "STILL", 0.0)
    patient = bench.bench_training(tiny_dataset, "wifi", None, few)
    assert not patient["still"] and patient["steps"] == 15
    assert eager["loss_start"] == patient["loss_start"]
    assert 0.0 < patient["start_s"] < patient["train_s"]
    asked = bench.bench_training(tiny_dataset, "wifi", None, bench.TrainingBench(40, steps=7))
    assert asked["steps"] == 7 and asked["gaussians"] == 40


def test_unknown_radios_are_named(tiny_dataset: Path) -> None:
    with pytest.raises(RfgsError, match="has no radio 'lidar'; it has"):
        bench.bench_training(tiny_dataset, "lidar", None)
