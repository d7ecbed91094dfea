# SPDX-License-Identifier: Apache-2.0
"""Every preset, as it is, between devices that nothing stands around: Friis to the last digit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from rfgs_core.radio import PRESETS, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeBundle = Callable[..., Bundle]
BOUNDS_M = np.array([[0.0, 0.0, 0.0], [6.0, 5.0, 2.7]])
#: Sites one above the other have no defined sign of a vertical polarisation.
STEEP = 0.999


@pytest.mark.parametrize("name", [n for n, each in PRESETS.items() if each.samples_per_frame == 1])
def test_free_space_is_friis_in_amplitude_and_phase(make_bundle: MakeBundle, name: str) -> None:
    """H = λ/(4πd) e^{−jkd} for every measured link and subcarrier."""
    from dataset_factory.trace import Tracer
    from rfgs_core.radio.sites import centres

    radio = replace(PRESETS[name], num_devices=2)
    devices = place_devices(radio, BOUNDS_M)
    elements = layout(radio, devices)
    csi = Tracer(make_bundle(static=[]), radio, devices, depth=1).static()
    assert csi.shape == (*elements.measured.shape, radio.num_subcarriers)
    assert not csi[~elements.measured].any()
    way = (elements.rx_xyz[None] - elements.tx_xyz[:, None])[elements.measured]
    distance = np.linalg.norm(way, axis=1)[:, None]
    wavenumber = 2.0 * np.pi * radio.freq_hz / SPEED_OF_LIGHT
    friis = np.exp(-1j * wavenumber * distance) / (2.0 * wavenumber * distance)
    ratio = csi[elements.measured] / friis
    assert np.abs(np.abs(ratio) - 1.0).max() < 1e-3
    tx_centres, rx_centres = centres(elements)
    middle = rx_centres[elements.rx_site][None] - tx_centres[elements.tx_site][:, None]
    middle = middle[elements.measured]
    level = np.abs(middle[:, 2]) < STEEP * np.linalg.norm(middle, axis=1)
    assert level.any() and np.abs(ratio[level] - 1.0).max() < 1e-3
