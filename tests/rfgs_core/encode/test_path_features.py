# SPDX-License-Identifier: Apache-2.0
"""Delay–angle features of made-up paths: closed forms, and what must not be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.encode.path_features import ANGLE_RAD, PathFeatures
from rfgs_core.measure.observations import Observations
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.path_table import PathTable, ends_rad

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 3.5, 2.5]])
RADIO = Radio("wifi", 5.5e9, 6.0e9, 32, 1, 1, 2, 2, (0.0, 0.0, -0.3))
PLACE_M = np.array([1.7, 2.1, 1.2])


@pytest.fixture
def seen() -> Observations:
    elements = layout(RADIO, place_devices(RADIO, BOUNDS_M))
    nothing = np.zeros((4, 16, 32), np.complex64)
    links, subcarriers = elements.measured.copy(), np.ones(32, bool)
    return Observations(nothing, nothing, links, subcarriers, elements, RADIO.freq_hz, BOUNDS_M)


def table_of(seen: Observations, pairs: list[tuple[int, int]], place: np.ndarray) -> PathTable:
    """One single-bounce path by way of `place` for each pair of devices."""
    tx = np.array([a for a, _ in pairs], np.int32)
    rx = np.array([b for _, b in pairs], np.int32)
    ends = [
        np.stack([xyz[site == number].mean(axis=0) for number in numbers])
        for xyz, site, numbers in (
            (seen.layout.tx_xyz, seen.layout.tx_site, tx),
            (seen.layout.rx_xyz, seen.layout.rx_site, rx),
        )
    ]
    vertices = np.stack([ends[0], np.tile(place, (len(pairs), 1)), ends[1]], axis=1)
    length_m = np.linalg.norm(np.diff(vertices, axis=1), axis=2).sum(axis=1)
    kind = np.full((len(pairs), 1), 16, np.uint8)
    rising = np.linspace(1.0, 2.0, 2) * np.exp(0.3j)
    return PathTable(
        *(tx, rx, tx, rx, np.tile(rising, (len(pairs), 1, 1)).astype(np.complex64)),
        RADIO.freq_hz[[0, -1]],
        length_m / SPEED_OF_LIGHT,
        np.zeros(len(pairs), np.float32),
        **ends_rad(vertices, kind),
        kind=kind,
        object=np.ones((len(pairs), 1), np.int32),
        vertices=vertices.astype(np.float32),
    )


def test_one_path_has_its_closed_form(seen) -> None:
    table = table_of(seen, [(0, 1)], PLACE_M)
    points = PLACE_M + np.random.default_rng(0).uniform(-0.3, 0.3, (40, 3))
    got = PathFeatures(table)(seen, np.concatenate([PLACE_M[None], points]))
    start, end = table.vertices[0, [0, 2]].astype(float)
    width_m = 0.5 * SPEED_OF_LIGHT / (RADIO.freq_hz[-1] - RADIO.freq_hz[0])
    amplitude = np.linspace(1.0, 2.0, 32)
    amplitude /= np.sqrt(np.mean(amplitude**2))
    np.testing.assert_allclose(got[0], amplitude, rtol=1e-3)
    for row, point in zip(got[1:], points, strict=True):
        miss = np.linalg.norm(PLACE_M - start) + np.linalg.norm(PLACE_M - end)
        miss -= np.linalg.norm(point - start) + np.linalg.norm(point - end)
        exponent = -((miss / width_m) ** 2)
        for corner in (start, end):
            u, v = (PLACE_M - corner), (point - corner)
            turn = np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
            exponent -= (turn / ANGLE_RAD) ** 2
        np.testing.assert_allclose(row, amplitude * np.exp(0.5 * exponent), rtol=2e-3)


def test_pairs_agree_on_the_place_and_nothing_else(seen) -> None:
    """Features are ordered by frequency, all pairs count alike, and corners are not read."""
    pairs = [(0, 1), (1, 2), (2, 3), (3, 3)]
    table = table_of(seen, pairs, PLACE_M)
    points = np.random.default_rng(1).uniform(BOUNDS_M[0], BOUNDS_M[1], (500, 3))
    features = PathFeatures(table)(seen, np.concatenate([PLACE_M[None], points]))
    strength = np.linalg.norm(features, axis=1)
    assert strength[0] > strength[1:].max()
    assert (np.diff(features[0]) > 0).all()
    gain = np.array([1, 9, 1, 1], np.complex64)[:, None, None]
    louder = replace(table, amplitude=table.amplitude * gain)
    lost = replace(louder, vertices=np.zeros_like(table.vertices))
    np.testing.assert_allclose(PathFeatures(lost)(seen, points), features[1:], rtol=1e-5)


def test_hidden_pairs_are_not_read(seen) -> None:
    table = table_of(seen, [(0, 1), (1, 2)], PLACE_M)
    alone = table_of(seen, [(0, 1)], PLACE_M)
    hidden = seen.links.copy()
    hidden[1, seen.layout.rx_device == 2] = False
    points = PLACE_M + np.random.default_rng(2).uniform(-0.3, 0.3, (9, 3))
    got = PathFeatures(table)(replace(seen, links=hidden), points)
    np.testing.assert_array_equal(got, PathFeatures(alone)(seen, points))
    assert (PathFeatures(alone)(replace(seen, links=0 * seen.links > 0), points) == 0).all()
