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
from rfgs_core.radio import layout
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import preset
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.worlds.figure import Figure, seen_from

BOUNDS_M = np.array([[-2.5, -2.5, 0.0], [2.5, 2.5, 2.6]])
WAVELENGTH_M = 0.05


@cache
def _walker() -> tuple[Figure, Stride]:
    """Another body in clothes than the one that explains it, its facets, and its stride."""
    body = people().random(np.random.default_rng(11))
    return Figure.of(body, WAVELENGTH_M), strides(body, 0.9, 1, seed=4)[0]


def _heard(pose: Pose) -> Observations:
    """What a Wi-Fi radio hears of the walker's direct echoes in a pose."""
    figure = _walker()[0]
    radio = preset("wifi")
    radio = replace(radio, rx_rows=2, rx_cols=3)
    placed = layout(radio, place_devices(radio, BOUNDS_M))
    posed = figure.posed(pose)
    csi = np.zeros((len(placed.tx_xyz), len(placed.rx_xyz), radio.num_subcarriers), complex)
    for a, b in placed.pairs_of(placed.measured)[1]:
        own = placed.links_between(a, b) & placed.measured
        tx, rx = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
        ends = placed.tx_xyz[tx], placed.rx_xyz[rx]
        seen = [seen_from(posed, figure.body.faces, end.mean(axis=0)) for end in ends]
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
    """What is heard of the walker in a pose that is turned [rad] and moved to a place [m]."""

    def hear(pose: Pose, heading: float, place: np.ndarray) -> Observations:
        return _heard(pose.turned(about_z(heading)).moved(place))

    return hear
