# SPDX-License-Identifier: Apache-2.0
"""Material hints: the slab formula, what bands can tell, and what they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.predict.material import Levels, levels_of, material_sentence, material_weights
from rfgs_core.radio import layout, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.reflection import material_permittivity, slab_reflection
from rfgs_core.radio.tissue import normal_reflection


def levels(name: str, freq_hz: np.ndarray, surface_m2: float, speckle_db: float) -> Levels:
    """What an ideal body of a material shows."""
    rcs_m2 = np.abs(slab_reflection(name, freq_hz)) ** 2 * surface_m2 / 4
    return Levels(freq_hz, rcs_m2, np.full(len(freq_hz), speckle_db))


def test_metal_reflects_everything_and_skin_like_a_half_space() -> None:
    freq_hz = np.array([5.8e9, 62e9])
    np.testing.assert_allclose(slab_reflection("metal", freq_hz), -1, atol=2e-3)
    half_space = normal_reflection(material_permittivity("skin", freq_hz))
    np.testing.assert_allclose(slab_reflection("skin", freq_hz), half_space, rtol=1e-3)


def test_a_half_wave_window_is_clear_and_a_quarter_wave_one_reflects_most() -> None:
    """Thickness of λ/2 and λ/4 inside glass; (ε−1)/(ε+1) is the closed form of the latter."""
    root = np.sqrt(6.31)
    half_hz = SPEED_OF_LIGHT / (2 * root * MATERIALS["glass"].thickness_m)
    reflected = np.abs(slab_reflection("glass", np.array([half_hz, 0.5 * half_hz])))
    assert reflected[0] < 0.05
    assert reflected[1] == pytest.approx((6.31 - 1) / (6.31 + 1), rel=0.02)


def test_every_material_has_a_permittivity() -> None:
    for material in MATERIALS.values():
        freq_hz = np.array([max(material.freq_min_hz, 1e9), material.freq_max_hz])
        permittivity = material_permittivity(material.name, freq_hz)
        assert (permittivity.real >= 1).all() and (permittivity.imag <= 0).all()


def test_bands_far_apart_name_a_material_that_changes_between_them() -> None:
    freq_hz = np.array([2.4e9, 5.8e9, 10e9, 24e9, 40e9])
    weights = material_weights(levels("wood", freq_hz, 1.6, 0.5), 1.6)
    assert next(iter(weights)) == "wood"
    assert weights["wood"] > 0.9
    assert sum(weights.values()) == pytest.approx(1)
    assert list(weights.values()) == sorted(weights.values(), reverse=True)
    sentence = material_sentence(levels("wood", freq_hz, 1.6, 0.5), weights)
    assert sentence.startswith("reflects like wood (")


def test_one_narrow_band_cannot_tell_and_says_so() -> None:
    one = levels("skin", np.array([5.8e9]), 1.6, 1.0)
    weights = material_weights(one, 1.6)
    assert max(weights.values()) < 0.3
    sentence = material_sentence(one, weights)
    assert sentence.startswith("cannot be told from one level over frequency; about equally")
    assert "skin (" in sentence and "metal (" in sentence


def test_materials_unknown_at_a_frequency_are_not_candidates() -> None:
    weights = material_weights(levels("skin", np.array([5.8e9, 62e9]), 1.6, 1.0), 1.6)
    assert not {"brick", "plywood", "floorboard", "marble"} & set(weights)
    assert {"skin", "metal", "concrete"} <= set(weights)


def test_a_point_target_has_its_cross_section(make_points) -> None:
    radio = preset("wifi")
    bounds_m = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
    elements = layout(radio, place_devices(radio, bounds_m))
    gaussians = make_points([[2.0, 1.5, 1.0]], [0.25j])
    found = levels_of(gaussians, elements, radio.freq_hz)
    assert found is not None
    np.testing.assert_allclose(found.rcs_m2, [0.0625], rtol=2e-3)
    np.testing.assert_allclose(found.freq_hz, [5.8e9])
    # Four devices that hear themselves, each one look: 4.34 dB / 2.
    np.testing.assert_allclose(found.speckle_db, [2.171], rtol=1e-3)
    wide = levels_of(gaussians, elements, np.linspace(3.1e9, 10.6e9, 32))
    assert wide is not None and len(wide.freq_hz) == 4
    np.testing.assert_allclose(wide.rcs_m2, 0.0625, rtol=5e-3)


def test_only_backscatter_is_judged(make_points) -> None:
    """What devices hear of each other has another mean, and is left out."""
    radio = preset("wifi")
    bounds_m = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
    elements = layout(radio, place_devices(radio, bounds_m))
    gaussians = make_points([[2.0, 1.5, 1.0], [1.2, 2.0, 1.1]], [0.25, 0.25])
    own = elements.links_between(0, 0)
    for device in range(1, 4):
        own = own | elements.links_between(device, device)
    every = levels_of(gaussians, elements, radio.freq_hz)
    alone = levels_of(gaussians, replace(elements, measured=own), radio.freq_hz)
    assert every is not None and alone is not None
    np.testing.assert_allclose(every.rcs_m2, alone.rcs_m2)
    between = replace(elements, measured=elements.measured & ~own)
    assert levels_of(gaussians, between, radio.freq_hz) is None
