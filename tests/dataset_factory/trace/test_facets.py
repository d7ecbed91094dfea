# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.surface.cells import Cells
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.simulate.surface.points import surface_points

FREQ_HZ = np.array([5.8e9])
WAVELENGTH_M = SPEED_OF_LIGHT / 5.8e9


def cross_section_db(vertices: np.ndarray, faces: np.ndarray, views: np.ndarray) -> float:
    """Mean backscatter of a mesh of reflection 1 from far places, in dB over a square metre."""
    zeros = np.zeros(len(faces), np.int64)
    points = surface_points(vertices, faces, zeros, zeros, WAVELENGTH_M, seed=0)
    positions, normals = points.at(vertices)
    sigma = []
    for view in views:
        antenna, distance_m = view[None], np.linalg.norm(view)
        lit = (normals @ view > 0).astype(np.float64)
        h = facet_sum(positions, normals, points.areas, antenna, antenna, lit, FREQ_HZ)[0, 0, 0]
        # Radar equation: |H|² = λ² σ / ((4π)³ d⁴).
        sigma.append(abs(h) ** 2 * (4 * np.pi) ** 3 * distance_m**4 / WAVELENGTH_M**2)
    return float(10 * np.log10(np.mean(sigma)))


FRONT = np.array([[500.0, 0.0, 0.0]])
SIX_SIDES = 500.0 * np.concatenate([np.eye(3), -np.eye(3)])


def test_flat_plate_has_its_closed_form_cross_section() -> None:
    side = 0.6
    grid = np.linspace(-side / 2, side / 2, 25)
    y, z = (part.ravel() for part in np.meshgrid(grid, grid, indexing="ij"))
    vertices = np.stack([np.zeros_like(y), y, z], axis=1)
    cell = np.arange(24 * 25).reshape(24, 25)[:, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([cell, cell + 25, cell + 26], axis=1),
            np.stack([cell, cell + 26, cell + 1], axis=1),
        ]
    )
    expected = 10 * np.log10(4 * np.pi * side**4 / WAVELENGTH_M**2)
    assert cross_section_db(vertices, faces, FRONT) == pytest.approx(expected, abs=0.3)


def test_large_sphere_has_its_geometric_cross_section() -> None:
    radius = 0.3
    ball = trimesh.creation.icosphere(subdivisions=5, radius=radius)
    expected = 10 * np.log10(np.pi * radius**2)
    found = cross_section_db(np.asarray(ball.vertices), np.asarray(ball.faces), SIX_SIDES)
    assert found == pytest.approx(expected, abs=1.0)


def test_inside_out_mesh_scatters_the_same() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.25)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    turned = cross_section_db(vertices, faces[:, ::-1], SIX_SIDES)
    assert turned == pytest.approx(cross_section_db(vertices, faces, SIX_SIDES), abs=1.5)


def naive(points, normals, areas, tx, rx, freq_hz):
    """The formula of the module docstring, facet by facet."""
    k = 2 * np.pi * freq_hz / SPEED_OF_LIGHT
    total = np.zeros(len(freq_hz), dtype=complex)
    for p, n, area in zip(points, normals, areas, strict=True):
        d_t, d_r = np.linalg.norm(p - tx), np.linalg.norm(rx - p)
        k_i, k_s = (p - tx) / d_t, (rx - p) / d_r
        q = k_s - k_i
        q_t2 = q @ q - (q @ n) ** 2
        if -k_i @ n <= 0 or k_s @ n <= 0:
            continue
        size = area * (q @ n) / 2 / (4 * np.pi * d_t * d_r)
        total += 1j * size * np.exp(-(k**2) * q_t2 * area / 24 - 1j * k * (d_t + d_r))
    return total


def test_recurrence_over_subcarriers_matches_the_formula() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (150, 3))
    normals = rng.normal(size=(150, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    areas = rng.uniform(1e-5, 4e-4, 150)
    freq_hz = 60e9 + (np.arange(320) + 0.5) * 12.5e6
    tx, rx = np.array([2.0, 0.3, 0.4]), np.array([1.8, -0.5, 0.1])
    found = facet_sum(points, normals, areas, tx[None], rx[None], np.ones(150), freq_hz)[0, 0]
    expected = naive(points, normals, areas, tx, rx, freq_hz)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_facets_are_reciprocal() -> None:
    rng = np.random.default_rng(1)
    points, normals = rng.uniform(-0.5, 0.5, (80, 3)), np.tile([1.0, 0.0, 0.0], (80, 1))
    areas, tx, rx = np.full(80, 4e-4), np.array([[3.0, 1.0, 0.0]]), np.array([[2.0, -1.0, 0.5]])
    freq_hz = np.array([5.72e9, 5.8e9, 5.88e9])
    there = facet_sum(points, normals, areas, tx, rx, np.ones(80), freq_hz)
    back = facet_sum(points, normals, areas, rx, tx, np.ones(80), freq_hz)
    assert np.allclose(there, back, rtol=1e-9, atol=0)


def test_points_cover_the_surface_evenly() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.25)
    zeros = np.zeros(len(ball.faces), np.int64)
    points = surface_points(ball.vertices, ball.faces, zeros, zeros, WAVELENGTH_M, seed=3)
    assert points.areas.sum() == pytest.approx(ball.area, rel=1e-6)
    assert points.areas.std() < 0.25 * points.areas.mean()
    assert np.sqrt(points.areas.mean()) < 0.4 * WAVELENGTH_M
    away = np.array([1.0, 2.0, 3.0])
    moved, normals = points.at(np.asarray(ball.vertices) + away)
    outward = (moved - away) / 0.25
    assert np.sum(normals * outward, axis=1).min() > 0.99


def test_nearest_centres_are_those_of_a_plain_search() -> None:
    """Also where centres have moved away, beyond the reach of the last time."""
    rng = np.random.default_rng(4)
    places = rng.normal(size=(3000, 3))
    cells = Cells(places, rng.permutation(3000))
    for count in (200, 300, 20, 1, 400):
        centres = rng.normal(size=(count, 3)) + 0.1 * count
        _, nearest = KDTree(centres).query(places)
        np.testing.assert_array_equal(cells.around(centres), nearest)


def test_of_centres_that_are_as_near_the_tree_says_which() -> None:
    """Points of datasets stay where they were."""
    centres = np.stack(np.meshgrid(*3 * [np.arange(4.0)]), axis=-1).reshape(-1, 3)
    centres = np.random.default_rng(5).permutation(centres)
    places = centres[:40] + np.array([0.5, 0.5, 0.0])
    _, nearest = KDTree(centres).query(places)
    np.testing.assert_array_equal(Cells(places, np.arange(40)).around(centres), nearest)


def test_small_inner_parts_are_left_out() -> None:
    body = trimesh.creation.icosphere(subdivisions=3, radius=0.2)
    eye = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    both = trimesh.util.concatenate([body, eye])
    zeros = np.zeros(len(both.faces), np.int64)
    points = surface_points(both.vertices, both.faces, zeros, zeros, WAVELENGTH_M, seed=0)
    positions, _ = points.at(np.asarray(both.vertices))
    assert np.linalg.norm(positions, axis=1).min() > 0.18
