# SPDX-License-Identifier: Apache-2.0
"""The fast tracer against Sionna RT, and against image theory that neither of them knows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, layout, preset
from rfgs_core.radio.tissue import normal_reflection, skin_permittivity
from rfgs_core.simulate.surface.facets import facet_sum

Mesh = tuple[np.ndarray, np.ndarray]


def error_db(found: np.ndarray, exact: np.ndarray) -> float:
    power = np.sum(np.abs(found - exact) ** 2) / np.sum(np.abs(exact) ** 2)
    return float(10 * np.log10(power))


@pytest.mark.parametrize(("depth", "limit_db"), [(1, -50.0), (2, -20.0)])
def test_sionna_agrees_in_a_room(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
    coarse_capsule: Mesh,
    depth: int,
    limit_db: float,
) -> None:
    """csi_static, and what a body with its shadow adds, in a room."""
    from dataset_factory.trace import FastBundleTracer, Tracer

    bundle = make_bundle(mover=coarse_capsule)
    pair = [
        kind(bundle, small_radio, two_devices, depth=depth) for kind in (Tracer, FastBundleTracer)
    ]
    still = [tracer.static().astype(complex) for tracer in pair]
    assert error_db(still[1], still[0]) < -60.0
    frame = bundle.frame(1)
    reference, fast = (
        tracer.frame(frame) - static for tracer, static in zip(pair, still, strict=True)
    )
    assert error_db(fast, reference) < limit_db
    np.testing.assert_array_equal(pair[1].frame(frame), pair[1].frame(frame))
    np.testing.assert_array_equal(pair[1].samples(frame)[0], pair[1].frame(frame))


def test_a_metal_wall_doubles_the_antennas(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
    make_sheet: Callable[..., Mesh],
    coarse_capsule: Mesh,
) -> None:
    """By way of a perfect mirror people are lit by images of the antennas, turned by half."""
    from dataset_factory.trace import FastBundleTracer

    wall = make_sheet((0.0, -40.0, -40.0), (0.0, 80.0, 0.0), (0.0, 0.0, 80.0))
    bundle = make_bundle(static=[wall], mover=coarse_capsule, material="metal")
    radio = replace(small_radio, own_device_links="excluded")
    once, twice = (
        FastBundleTracer(bundle, radio, two_devices, depth=depth, shadow="hard") for depth in (1, 2)
    )
    frame = bundle.frame(1)
    found = twice.frame(frame).astype(complex) - once.frame(frame)
    assert twice._surface is not None
    facets = twice._surface.facets(frame.vertices)
    elements = layout(radio, two_devices)
    flip = np.array([-1.0, 1.0, 1.0])
    gamma = normal_reflection(skin_permittivity(radio.freq_hz))
    exact = np.zeros_like(found)
    for tx, rx in (
        (elements.tx_xyz * flip, elements.rx_xyz),
        (elements.tx_xyz, elements.rx_xyz * flip),
    ):
        ones = np.ones(len(facets.points))
        exact -= gamma * facet_sum(
            facets.points, facets.normals, facets.areas, tx, rx, ones, radio.freq_hz
        )
    exact[~elements.measured] = 0.0
    # A vertical antenna's field along θ stays along θ in the mirror; facets keep θ. Amplitudes by
    # way of a wall are those of the centres of arrays, here 4 cm beside elements 2 m away.
    assert error_db(found, exact) < -25.0


def test_what_the_fast_tracer_does_not_do_is_said(
    make_bundle: Callable[..., Bundle],
    small_radio: Radio,
    two_devices: list[DevicePose],
) -> None:
    from dataset_factory.trace import FastBundleTracer

    bundle = make_bundle()
    with pytest.raises(RfgsError, match="use --tracer sionna"):
        FastBundleTracer(bundle, preset("sar"), two_devices)
    with pytest.raises(RfgsError, match="trace depth 4: expected 1, 2 or 3"):
        FastBundleTracer(bundle, small_radio, two_devices, depth=4)


def test_an_empty_scene_is_friis(
    make_bundle: Callable[..., Bundle], small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    """Nothing stands and nobody is there."""
    from dataset_factory.trace import FastBundleTracer

    bundle = make_bundle(static=[])
    tracer = FastBundleTracer(bundle, small_radio, two_devices)
    static = tracer.static()
    np.testing.assert_array_equal(tracer.frame(bundle.frame(1)), static)
    elements = layout(small_radio, two_devices)
    t, r = (int(i) for i in np.argwhere(elements.measured)[-1])
    d = np.linalg.norm(elements.tx_xyz[t] - elements.rx_xyz[r])
    exact = 299_792_458.0 / (4 * np.pi * d * small_radio.freq_hz)
    np.testing.assert_allclose(np.abs(static[t, r]), exact, rtol=1e-3)
