# SPDX-License-Identifier: Apache-2.0
"""Patterns and polarisations through the whole trace: environment, people and bounces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from rfgs_core.radio import DevicePose, Radio, layout
from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS, field
from rfgs_core.radio.constants import SPEED_OF_LIGHT

MakeBundle = Callable[..., Bundle]
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: A quarter turn about the boresight: what was vertical lies down.
ROLLED = (0.5**0.5, 0.5**0.5, 0.0, 0.0)


def pair(radio: Radio, height_m: float, quat: tuple = UPRIGHT) -> tuple[Radio, list[DevicePose]]:
    """One element each; the second stands 3 m ahead of the first and higher."""
    radio = replace(
        radio,
        rx_rows=1,
        rx_cols=1,
        tx_offset_m=(0.0, 0.0, 0.0),
        num_subcarriers=4,
        own_device_links="excluded",
    )
    return radio, [
        DevicePose("a", (0.5, 1.0, 1.0), UPRIGHT),
        DevicePose("b", (3.5, 1.0, 1.0 + height_m), quat),
    ]


@pytest.mark.parametrize("pattern", PATTERNS)
def test_patterns_are_those_of_sionna(pattern: str) -> None:
    import mitsuba as mi
    import sionna.rt as rt

    random = np.random.default_rng(2)
    theta, phi = random.uniform(0.05, np.pi - 0.05, 200), random.uniform(-np.pi, np.pi, 200)
    away = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 1)
    along = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)], 1)
    across = np.stack([-np.sin(phi), np.cos(phi), np.zeros(200)], axis=1)
    for name, slants in POLARIZATIONS.items():
        array = rt.PlanarArray(num_rows=1, num_cols=1, pattern=pattern, polarization=name)
        models = array.antenna_pattern.patterns
        assert len(models) == len(slants)
        for model, slant_deg in zip(models, slants, strict=True):
            parts = model(mi.Float(theta.astype(np.float32)), mi.Float(phi.astype(np.float32)))
            c_theta, c_phi = (np.array(part.real) for part in parts)
            ours = field(pattern, slant_deg, away, np.eye(3))
            np.testing.assert_allclose((ours * along).sum(axis=1), c_theta, atol=2e-5)
            np.testing.assert_allclose((ours * across).sum(axis=1), c_phi, atol=2e-5)


@pytest.mark.parametrize("height_m", [0.0, 2.0])
def test_dipoles_have_their_closed_form_in_both_terms(
    make_bundle: MakeBundle,
    small_radio: Radio,
    coarse_capsule: tuple[np.ndarray, np.ndarray],
    height_m: float,
) -> None:
    """cos(π/2 cos θ)/sin θ at both ends, for the direct path and for every person's facet."""
    from dataset_factory.trace import Tracer

    def gain(way: np.ndarray) -> np.ndarray:
        cosine = way[..., 2] / np.linalg.norm(way, axis=-1)
        return np.sqrt(1.643) * np.cos(0.5 * np.pi * cosine) / np.sqrt(1.0 - cosine**2)

    radio, devices = pair(small_radio, height_m)
    dipoles = replace(radio, pattern="hw_dipole")
    tx, rx = (np.array(device.position_m) for device in devices)
    empty = make_bundle(static=[])
    iso = Tracer(empty, radio, devices, depth=1).static()[0, 1]
    found = Tracer(empty, dipoles, devices, depth=1).static()[0, 1]
    np.testing.assert_allclose(found / iso, gain(rx - tx) ** 2, rtol=1e-4)

    bundle = make_bundle(static=[], mover=coarse_capsule)
    tracer = Tracer(bundle, dipoles, devices, depth=1)
    lone = Tracer(bundle, radio, devices, depth=1)
    # One facet at a time: the body is far from a point, so each has factors of its own.
    points = tracer._bodies.points(bundle.frame(1).vertices)
    for index in (0, len(points.areas) // 2):
        one = replace(
            points,
            **{
                name: getattr(points, name)[index : index + 1]
                for name in ("positions", "normals", "areas", "material")
            },
        )
        # Turned half way between both ends, so that it is lit and seen.
        towards = 0.5 * (tx + rx) - one.positions
        normals = towards / np.linalg.norm(towards)
        one = replace(one, normals=normals + 0.0)
        values = [_direct(each, one) for each in (tracer, lone)]
        factor = gain(one.positions[0] - tx) * gain(one.positions[0] - rx)
        np.testing.assert_allclose(values[0], factor * values[1], rtol=1e-9)
        assert np.abs(values[1]).min() > 0


def _direct(tracer, points) -> np.ndarray:
    """The direct term of some points between the two devices, without the body's own shadow."""
    from dataset_factory.trace.people.sight import in_sight
    from dataset_factory.trace.rays.scene import environment_scene
    from rfgs_core.simulate.surface.direct import direct_channel

    free = environment_scene(tracer._bundle, tracer._radio)
    gamma = tracer._bodies.gamma(tracer._radio.freq_hz)
    devices, radio = tracer._devices, tracer._radio
    seen = in_sight(free.mi_scene, points, tracer._layout)
    return direct_channel(points, seen, tracer._layout, devices, gamma, radio)[0, 1]


@pytest.mark.parametrize("polarization", ["V", "H"])
def test_a_rolled_receiver_hears_nothing_straight_ahead(
    make_bundle: MakeBundle, small_radio: Radio, polarization: str
) -> None:
    from dataset_factory.trace import Tracer

    radio, devices = pair(replace(small_radio, polarization=polarization), 0.0)
    bundle = make_bundle(static=[])
    upright = Tracer(bundle, radio, devices, depth=1).static()[0, 1]
    _, rolled = pair(radio, 0.0, ROLLED)
    crossed = Tracer(bundle, radio, rolled, depth=1).static()[0, 1]
    friis = SPEED_OF_LIGHT / radio.freq_hz / (4 * np.pi * 3.0)
    np.testing.assert_allclose(np.abs(upright), friis, rtol=1e-4)
    # float32 in the ray tracer leaves −120 dB at best.
    assert np.abs(crossed).max() < 1e-5 * friis.max()


@pytest.mark.parametrize("polarization", ["VH", "cross"])
def test_ports_of_dual_antennas_do_not_mix_in_free_space(
    make_bundle: MakeBundle, small_radio: Radio, polarization: str
) -> None:
    from dataset_factory.trace import Tracer

    radio, devices = pair(replace(small_radio, polarization=polarization), 0.0)
    elements = layout(radio, devices)
    assert elements.tx_device.tolist() == [0, 0, 1, 1]
    assert elements.tx_port.tolist() == [0, 1, 0, 1]
    np.testing.assert_array_equal(elements.rx_xyz[2], elements.rx_xyz[3])
    csi = Tracer(make_bundle(static=[]), radio, devices, depth=1).static()[:2, 2:]
    friis = SPEED_OF_LIGHT / radio.freq_hz / (4 * np.pi * 3.0)
    power = np.abs(csi).max(axis=2) / friis.max()
    # Two antennas that face each other are mirror images: +45° meets −45°.
    expected = np.eye(2) if polarization == "VH" else np.eye(2)[::-1]
    np.testing.assert_allclose(power, expected, atol=1e-4)


@pytest.mark.parametrize("pattern", ["iso", "tr38901"])
@pytest.mark.parametrize("polarization", ["H", "cross"])
def test_direct_term_of_any_antenna_matches_the_solver(
    make_bundle: MakeBundle,
    small_radio: Radio,
    coarse_capsule: tuple[np.ndarray, np.ndarray],
    pattern: str,
    polarization: str,
) -> None:
    from dataset_factory.trace import Tracer
    from dataset_factory.trace.bounces.solver import Bounces, with_facets
    from dataset_factory.trace.people.sight import in_sight
    from dataset_factory.trace.rays.paths import path_set
    from rfgs_core.radio.sites import centres
    from rfgs_core.simulate.paths.steering import steer
    from rfgs_core.simulate.surface.direct import direct_channel

    radio, devices = pair(replace(small_radio, pattern=pattern, polarization=polarization), 0.4)
    devices = [replace(devices[0], quat_wxyz=(0.95, 0.2, 0.1, 0.2)), devices[1]]
    bundle = make_bundle(static=[], mover=coarse_capsule)
    tracer = Tracer(bundle, radio, devices, depth=2)
    tracer._bodies.move(bundle.frame(1).vertices)
    points, elements, nodes = (
        tracer._bodies.points(bundle.frame(1).vertices),
        layout(radio, devices),
        radio.freq_hz,
    )
    scene, meshes = tracer._bodies.scene, tracer._environment.meshes
    bounces = Bounces(scene, meshes, elements, devices, depth=2, seed=1)
    bounces._hang(points.lifted)
    traced = bounces._solver(scene, max_depth=1, samples_per_sp=1, buffer_size_per_sp=16, seed=0)
    paths = path_set(traced, *centres(elements))
    paths = with_facets(paths, points, tracer._bodies.gamma(nodes), nodes, radio.centre_hz)
    solver = steer(paths, elements, radio.freq_hz, nodes)
    scene, gamma = tracer._bodies.scene.mi_scene, tracer._bodies.gamma(nodes)
    seen = in_sight(scene, points, elements)
    # Sionna casts its rays from outside the skin, so that is where both put the points.
    outside = replace(points, positions=points.lifted)
    ours = direct_channel(outside, seen, elements, devices, gamma, radio)
    assert np.linalg.norm(solver) > 0
    error = np.linalg.norm(ours - solver) / np.linalg.norm(solver)
    assert 20 * np.log10(error) < -80.0
