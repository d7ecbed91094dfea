# SPDX-License-Identifier: Apache-2.0
"""The plain command makes a valid dataset with every preset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.check.validate import validate
from rfgs_core.dataset import open_dataset
from rfgs_core.radio import PRESETS


@pytest.mark.slow
# The 180 places of sar take minutes; test_aperture_dataset.py makes a smaller aperture.
@pytest.mark.parametrize("name", [n for n, each in PRESETS.items() if not each.antennas_move])
def test_a_whole_dataset_is_made_and_valid(
    factory: Callable, box_room: Path, tmp_path: Path, name: str
) -> None:
    out = tmp_path / "dataset"
    # The arrays of uwb are 3 m long: the room becomes one of 4.2 m.
    done = factory(
        *("generate", str(box_room), "--radio", name, "--frames", "1:2", "--no-images"),
        *("--unit-scale", "1.4", "--workers", "1", "--out", str(out)),
    )
    assert done.returncode == 0, done.stderr[-2000:]
    told = f"{name}: traced at depth 1, as its band is ultra-wide" in done.stderr + done.stdout
    assert told == PRESETS[name].ultra_wide
    assert validate(out) == []
    sequence = open_dataset(out).sequence()
    assert sequence.trace_depth(name) == min(2, PRESETS[name].deepest)
    moved = sequence.csi(name, 2) - sequence.csi(name, 1)
    assert np.abs(moved).max() > 0
