# SPDX-License-Identifier: Apache-2.0
"""Facets over a grid of delays against the plain sum over subcarriers; antennas and slabs too."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.radio import DevicePose, layout, preset
from rfgs_core.radio.antennas import PATTERNS, field, spherical_basis
from rfgs_core.radio.reflection import slab
from rfgs_core.simulate.paths.fields import past_slab
from rfgs_core.simulate.scatter.antenna import CODES, Antenna, sent_towards
from rfgs_core.simulate.scatter.grid import array_reach, delay_grid, to_subcarriers
from rfgs_core.simulate.scatter.kernel import Arrays, Patches, spread_facets
from rfgs_core.simulate.scatter.waves import past
from rfgs_core.simulate.scatter.ways import _offsets
from rfgs_core.simulate.surface.facets import facet_sum

DEVICES = [
    DevicePose("a", (0.2, 0.3, 1.2), (1.0, 0.0, 0.0, 0.0)),
    DevicePose("b", (4.0, 3.0, 2.2), (0.0, 0.0, 0.0, 1.0)),
]


@pytest.mark.parametrize(("name", "heard_by"), [("wifi", 1), ("mmwave", 0), ("uwb", 1)])
def test_the_grid_gives_the_plain_sum(name: str, heard_by: int) -> None:
    """Every element and subcarrier, near field and damping included, to -55 dB."""
    radio = preset(name)
    elements = layout(radio, DEVICES)
    rng = np.random.default_rng(0)
    points = np.array([2.0, 2.0, 1.0]) + rng.normal(size=(600, 3)) * [0.2, 0.2, 0.5]
    normals = rng.normal(size=(600, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    areas = np.full(600, 2e-4)
    tx = elements.tx_xyz[elements.tx_site == 0]
    rx = elements.rx_xyz[elements.rx_site == heard_by]
    grid = delay_grid(radio, elements)
    found = _spread(points, normals, areas, tx, rx, grid)
    exact = facet_sum(points, normals, areas, tx, rx, np.ones(600), radio.freq_hz)
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    assert error < 10 ** (-55 / 20)


def _spread(points, normals, areas, tx, rx, grid) -> np.ndarray:
    nodes = len(grid.node_k)
    fields = np.zeros((1, len(points), 2, nodes), dtype=np.complex64)
    fields[:, :, 0] = 1.0
    cells = np.zeros((1, nodes, 2, grid.cells, len(tx) * len(rx)), dtype=np.float32)
    size_m = sum(array_reach(xyz, np.zeros(len(xyz), dtype=int)) for xyz in (tx, rx))
    ones, material = np.ones((1, nodes), dtype=np.complex64), np.zeros(len(points), dtype=np.int64)
    tx_centre, rx_centre = tx.mean(axis=0), rx.mean(axis=0)
    tx_offset = _offsets(np.ascontiguousarray(tx.T), tx_centre)
    rx_offset = _offsets(np.ascontiguousarray(rx.T), rx_centre)
    spread_facets(
        Patches(points, normals, areas, ones, material),
        np.arange(len(points)),
        fields[0],
        (fields, np.ones(fields.shape[:2], dtype=np.bool_), np.zeros(1, dtype=np.int64)),
        Arrays(tx_centre[None], tx_offset[None], rx_centre, rx_offset, size_m),
        (grid.cell_m, grid.centre_k, grid.node_k),
        np.ones(1, dtype=bool),
        np.zeros(1, dtype=np.int64),
        cells,
    )
    channel = to_subcarriers(grid, cells[0])
    return channel.T.reshape(len(tx), len(rx), -1)


@pytest.mark.parametrize("pattern", list(PATTERNS))
@pytest.mark.parametrize("slant_deg", [0.0, 45.0, 90.0])
def test_compiled_antennas_are_those_of_numpy(pattern: str, slant_deg: float) -> None:
    rng = np.random.default_rng(1)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes *= np.sign(np.linalg.det(axes))
    ways = rng.normal(size=(50, 3))
    slant = float(np.cos(np.deg2rad(slant_deg))), float(np.sin(np.deg2rad(slant_deg)))
    antenna = Antenna(CODES[pattern], slant, axes, 0.1)
    found = np.array([sent_towards(antenna, way) for way in ways])
    np.testing.assert_allclose(found, field(pattern, slant_deg, ways, axes), atol=1e-12)


def test_straight_up_and_down_have_a_fixed_azimuth() -> None:
    theta, phi = spherical_basis(np.array([[0.0, 0.0, 2.0], [1e-12, -1e-12, -3.0]]))
    np.testing.assert_allclose(theta, [[1, 0, 0], [-1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(phi, [[0, 1, 0], [0, 1, 0]], atol=1e-12)


@pytest.mark.parametrize("mirrors", [True, False])
def test_compiled_slabs_are_those_of_numpy(mirrors: bool) -> None:
    """A wave of any polarisation past a slab at any angle, single precision and a table apart."""
    rng = np.random.default_rng(2)
    freq_hz, cosines = np.array([5.7e9, 5.9e9]), np.linspace(0.0, 1.0, 513)
    factors = slab("plasterboard", 0.0125, freq_hz, cosines)
    names = ("reflected_te", "reflected_tm") if mirrors else ("passed_te", "passed_tm")
    table = np.stack([getattr(factors, name) for name in names], axis=1).astype(np.complex64)
    normal = np.array([0.6, 0.0, 0.8])
    for into in rng.normal(size=(20, 3)):
        into /= np.linalg.norm(into)
        wave = np.cross(into, rng.normal(size=3))
        found = np.tile(wave, (2, 1)).astype(np.complex64)
        past(found, into, normal, mirrors, table)
        exact = past_slab(
            np.tile(wave, (1, 2, 1)).astype(complex),
            into[None],
            normal[None],
            np.array([mirrors]),
            ("plasterboard", 0.0125, freq_hz),
        )
        np.testing.assert_allclose(found, exact[0], atol=2e-3 * np.linalg.norm(wave))


def test_a_slab_gives_no_energy_and_hides_itself_at_the_brewster_angle() -> None:
    """ITU-R P.2040-4: |R|² + |T|² ≤ 1; a thick slab's TM reflection all but ends at arctan √ε'."""
    freq_hz, cosines = np.array([5.8e9]), np.linspace(0.01, 1.0, 500)
    factors = slab("concrete", 0.2, freq_hz, cosines)
    for r, t in (
        (factors.reflected_te, factors.passed_te),
        (factors.reflected_tm, factors.passed_tm),
    ):
        assert (np.abs(r) ** 2 + np.abs(t) ** 2 <= 1.0 + 1e-12).all()
    thick = np.abs(slab("concrete", 5.0, freq_hz, cosines).reflected_tm[:, 0])
    brewster = np.cos(np.arctan(np.sqrt(5.24)))
    assert abs(cosines[np.argmin(thick)] - brewster) < 0.01 and thick.min() < 0.03
