# SPDX-License-Identifier: Apache-2.0
"""What the factory makes of the radio devices that the add-on places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.devices import choose_devices
from rfgs_core.radio import preset

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def furnished(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room without devices, with a cupboard in the corner where the first one would stand."""
    folder = tmp_path_factory.mktemp("furnished")
    python(HERE / "build_devices.py", folder, must_work=True)
    return folder


@pytest.mark.parametrize("name", ["wifi", "uwb", "sar"])
def test_placed_devices_are_those_of_the_factory(furnished: Path, name: str) -> None:
    theirs, guess = choose_devices(read_bundle(furnished / "bare"), preset(name))
    ours, none = choose_devices(read_bundle(furnished / name), preset(name))
    assert guess is not None and none is None
    assert len(ours) == len(theirs) and [row.role for row in ours] == [row.role for row in theirs]
    places = [np.array([row.position_m for row in rows]) for rows in (ours, theirs)]
    np.testing.assert_allclose(*places, atol=1e-5)
    turns = [np.array([row.quat_wxyz for row in rows]) for rows in (ours, theirs)]
    np.testing.assert_allclose(abs(np.sum(turns[0] * turns[1], axis=1)), 1.0, atol=1e-6)
    if name == "wifi":
        assert places[0][0, 2] == pytest.approx(2.2, abs=0.02), "not inside the cupboard"
