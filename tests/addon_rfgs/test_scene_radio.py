# SPDX-License-Identifier: Apache-2.0
"""Properties of Empties, saved in a Blender file, are the radio that is traced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.radios import scene_radio
from rfgs_core.dataset import open_dataset
from rfgs_core.radio import preset

OWN = {
    "num_subcarriers": 16,
    "tx_rows": 2,
    "tx_cols": 2,
    "rx_rows": 2,
    "rx_cols": 3,
    "tx_spacing_m": 0.07,
    "rx_spacing_m": 0.06,
    "tx_offset_m": (0.0, 0.05, -0.2),
    "own_device_links": "excluded",
    "isolation_db": 12.5,
    "power_dbm": 7.25,
    "noise_figure_db": 5.5,
    "pattern": "hw_dipole",
    "polarization": "VH",
}


def test_every_property_of_an_empty_arrives(scenes: Path) -> None:
    found = asdict(scene_radio(read_bundle(scenes / "own_radio")))
    assert found.pop("freq_min_hz") == pytest.approx(2.40e9, abs=1e3)
    assert found.pop("freq_max_hz") == pytest.approx(2.48e9, abs=1e3)
    rest = {key: value for key, value in asdict(preset("wifi")).items() if key in found}
    assert found == {**rest, **OWN, "name": "scene", "num_devices": 2}
    # Nothing was left at a default that would look right by itself.
    assert not [key for key, value in OWN.items() if value == rest[key]]


@pytest.mark.slow
def test_radio_scene_traces_what_the_empties_say(
    python: Callable, scenes: Path, tmp_path: Path
) -> None:
    out = tmp_path / "dataset"
    python(
        *("-m", "dataset_factory", "generate", scenes / "own_radio.blend", "--radio", "scene"),
        *("--frames", "1:2", "--depth", "1", "--no-images", "--workers", "1", "--out", out),
        must_work=True,
    )
    sequence = open_dataset(out).sequence()
    radio, csi = sequence.radio_spec("scene"), sequence.csi("scene", 1)
    assert (radio.pattern, radio.polarization) == ("hw_dipole", "VH")
    assert [row.name for row in sequence.devices("scene")] == ["box0", "box1"]
    # Two devices of 2 x 2 and 2 x 3 elements with two ports each, between devices only.
    assert csi.shape == (16, 24, 16)
    measured = sequence.layout("scene").measured
    assert measured.sum() == 2 * 8 * 12 and not csi[~measured].any()
    assert np.abs(csi[measured]).max() > 0
    # An aligned port hears its like louder than its opposite.
    layout = sequence.layout("scene")
    same = measured & (layout.tx_port[:, None] == layout.rx_port)
    level = np.abs(csi) ** 2
    assert level[same].mean() > 10 * level[measured & ~same].mean()
