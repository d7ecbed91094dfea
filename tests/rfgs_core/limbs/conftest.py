# SPDX-License-Identifier: Apache-2.0
"""Somebody who walks through an empty room, as facets of their own scatter to a radio."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.limbs.evidence.library import Stride, about_z, strides
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import Radio, layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import preset
from rfgs_core.simulate.geometry.bvh import Bvh, build_bvh
from rfgs_core.simulate.geometry.rays import blocked, new_stack
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.worlds.figure import Figure, Posed
from rfgs_core.worlds.motion import random_motion

BOUNDS_M = np.array([[-2.5, -2.5, 0.0], [2.5, 2.5, 2.6]])
WAVELENGTH_M = 0.05


@cache
def _walker(wavelength_m: float = WAVELENGTH_M) -> tuple[Figure, Stride]:
    """Another body in clothes than the one that explains it, its facets, and its stride."""
    body = people().random(np.random.default_rng(11))
    return Figure.of(body, wavelength_m), strides(body, 0.9, 1, seed=4)[0]


def _sees(place: np.ndarray, posed: Posed, skin: Bvh) -> np.ndarray:
    """Facets that face a place and that no triangle of the skin hides from it."""
    stack = new_stack()
    faces = np.einsum("fi,fi->f", place - posed.points, posed.normals) > 0.0
    hidden = [blocked(skin, point, place, 4e-3, stack) for point in posed.points]
    return faces & ~np.array(hidden)


def _heard(pose: Pose, radio: Radio, figure: Figure) -> Observations:
    """What a radio hears of the walker's direct echoes in a pose."""
    placed = layout(radio, place_devices(radio, BOUNDS_M))
    posed = figure.posed(pose)
    skin = build_bvh(figure.body.skin(pose)[figure.body.faces].astype(np.float64))
    csi = np.zeros((len(placed.tx_xyz), len(placed.rx_xyz), radio.num_subcarriers), complex)
    for a, b in placed.pairs_of(placed.measured)[1]:
        own = placed.links_between(a, b) & placed.measured
        tx, rx = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
        ends = placed.tx_xyz[tx], placed.rx_xyz[rx]
        seen = [_sees(end.mean(axis=0), posed, skin) for end in ends]
        both = (seen[0] & seen[1]).astype(np.float64)
        csi[np.ix_(tx, rx)] = facet_sum(
            posed.points, posed.normals, figure.areas_m2, *ends, both, radio.freq_hz
        )
    return Observations(
        delta=csi.astype(np.complex64),
        static=np.zeros_like(csi, dtype=np.complex64),
        links=placed.measured,
        subcarriers=np.ones(radio.num_subcarriers, dtype=bool),
        layout=placed,
        freq_hz=radio.freq_hz,
        bounds_m=BOUNDS_M,
    )


@pytest.fixture(scope="session")
def stride() -> Stride:
    """How the walker goes, on the spot."""
    return _walker()[1]


@pytest.fixture(scope="session")
def walker_body() -> Body:
    """The walker at rest."""
    return _walker()[0].body


@pytest.fixture(scope="session")
def walker_joints() -> Callable[[Pose], np.ndarray]:
    """Joints of the walker in a pose."""
    return _walker()[0].body.joints17


@pytest.fixture(scope="session")
def heard() -> Callable[[Pose, float, np.ndarray], Observations]:
    """What Wi-Fi hears of the walker in a pose that is turned [rad] and moved to a place [m]."""
    radio = replace(preset("wifi"), rx_rows=2, rx_cols=3)

    def hear(pose: Pose, heading: float, place: np.ndarray) -> Observations:
        return _heard(pose.turned(about_z(heading)).moved(place), radio, _walker()[0])

    return hear


@pytest.fixture(scope="session")
def heard_by_radars() -> tuple[Observations, np.ndarray]:
    """What mmWave radars hear of the walker at some moment of a step, and where joints are [m]."""
    # So few subcarriers tell delays apart up to 20 ns, more than the room is long.
    radio = replace(preset("mmwave"), num_subcarriers=80)
    # Facets of two wavelengths are fine enough for powers of beams.
    figure, stride = _walker(2.0 * SPEED_OF_LIGHT / radio.centre_hz)
    pose = stride.poses[3].turned(about_z(0.7)).moved(np.array([0.4, -0.3, 0.0]))
    return _heard(pose, radio, figure), figure.body.joints17(pose)


@pytest.fixture(scope="session")
def who_lies_heard_by_radars() -> tuple[Observations, np.ndarray]:
    """What mmWave radars hear of the walker lying on something low, and where joints are [m]."""
    radio = replace(preset("mmwave"), num_subcarriers=80)
    figure, _ = _walker(2.0 * SPEED_OF_LIGHT / radio.centre_hz)
    lies = random_motion(np.random.default_rng(2), figure.body, "lie")
    pose = lies.at(0.5 * lies.duration_s)
    hips = figure.body.joints17(pose)[0]
    pose = pose.moved(np.array([0.3 - hips[0], -0.2 - hips[1], 0.0]))
    return _heard(pose, radio, figure), figure.body.joints17(pose)
