# SPDX-License-Identifier: Apache-2.0
"""The numbers that follow from a radio's band, and the materials' validity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import PRESETS, preset
from rfgs_core.radio.materials import MATERIALS


@pytest.mark.parametrize(
    ("name", "resolution_m", "unambiguous_m", "wavelength_m"),
    [
        # c / (2 · 160 MHz), c / 2.5 MHz, c / 5.8 GHz.
        ("wifi", 0.936851, 119.916983, 0.0516884),
        # c / (2 · 4 GHz), c / 12.5 MHz, c / 62 GHz.
        ("mmwave", 0.0374741, 23.983397, 0.00483536),
    ],
)
def test_derived_numbers(
    name: str, resolution_m: float, unambiguous_m: float, wavelength_m: float
) -> None:
    radio = preset(name)
    assert radio.range_resolution_m == pytest.approx(resolution_m, rel=1e-5)
    assert radio.unambiguous_path_m == pytest.approx(unambiguous_m, rel=1e-7)
    assert radio.wavelength_m == pytest.approx(wavelength_m, rel=1e-5)


@pytest.mark.parametrize("name", PRESETS)
def test_subcarriers_fill_the_band_evenly(name: str) -> None:
    radio = preset(name)
    assert radio.name == name
    subcarriers = radio.freq_hz
    assert subcarriers.shape == (radio.num_subcarriers,)
    np.testing.assert_allclose(np.diff(subcarriers), radio.subcarrier_spacing_hz, rtol=1e-6)
    assert subcarriers.mean() == pytest.approx(radio.centre_hz, rel=1e-12)
    # Subcarriers sit at the centres of their slices: half a spacing from the band's edges.
    half = 0.5 * radio.subcarrier_spacing_hz
    assert subcarriers[0] - radio.freq_min_hz == pytest.approx(half, rel=1e-6)
    assert radio.freq_max_hz - subcarriers[-1] == pytest.approx(half, rel=1e-6)


def test_an_unknown_preset_lists_the_known_ones() -> None:
    with pytest.raises(RfgsError, match=r"unknown radio 'lidar'; expected one of mmwave, .*wifi"):
        preset("lidar")


def test_a_material_covers_a_band_only_as_a_whole() -> None:
    wifi, mmwave = preset("wifi"), preset("mmwave")
    assert MATERIALS["concrete"].covers(wifi)
    assert MATERIALS["concrete"].covers(mmwave)
    # Brick ends at 40 GHz, floorboard begins at 50 GHz, marble ends inside the mmWave band.
    assert MATERIALS["brick"].covers(wifi)
    assert not MATERIALS["brick"].covers(mmwave)
    assert not MATERIALS["floorboard"].covers(wifi)
    assert MATERIALS["floorboard"].covers(mmwave)
    assert not MATERIALS["marble"].covers(mmwave)
    edge = replace(mmwave, freq_min_hz=59e9, freq_max_hz=60e9)
    assert MATERIALS["marble"].covers(edge)


def test_materials_are_possible() -> None:
    for name, material in MATERIALS.items():
        assert material.name == name
        assert 0 < material.freq_min_hz < material.freq_max_hz
        assert 0 < material.thickness_m < 1
        assert all(0 <= value <= 1 for value in material.colour)
