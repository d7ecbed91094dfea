# SPDX-License-Identifier: Apache-2.0
"""How the growth of cost is told."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from rfgs_core.scaling import Growth, spread_evenly


@pytest.mark.parametrize("power", [0.0, 0.9, 1.0, 2.0])
def test_the_exponent_of_a_power_law_is_its_power(power: float) -> None:
    sizes = (10, 40, 200, 1000)
    growth = Growth("law", sizes, tuple(3e-4 * size**power for size in sizes))
    assert growth.exponent == pytest.approx(power, abs=1e-12)


def test_a_fixed_cost_lowers_the_exponent() -> None:
    sizes = (10, 100, 1000)
    assert 0.5 < Growth("law", sizes, tuple(20.0 + size for size in sizes)).exponent < 0.9


@pytest.mark.parametrize("power", [0.9, 1.0, 1.1, 2.0])
@pytest.mark.parametrize("fixed_s", [0.0, 0.02, 3.0])
def test_what_does_not_grow_is_split_from_what_does(power: float, fixed_s: float) -> None:
    sizes = (16, 50, 160, 500, 1600)
    growth = Growth("law", sizes, tuple(fixed_s + 1e-3 * size**power for size in sizes))
    found_s, exponent = growth.law
    assert exponent == pytest.approx(power, abs=0.006)
    assert found_s == pytest.approx(fixed_s, abs=2e-3)


def test_of_what_is_flat_nothing_grows() -> None:
    found_s, exponent = Growth("law", (10, 100, 1000), (0.5, 0.5, 0.5)).law
    assert (found_s, exponent) == (pytest.approx(0.5), 0.0)


def test_facets_are_spread_over_a_sphere_evenly_and_face_outwards() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    facets = spread_evenly(np.asarray(sphere.vertices), np.asarray(sphere.faces), 20_000)
    assert facets.areas.sum() == pytest.approx(np.pi, rel=5e-3)
    outward = facets.points / np.linalg.norm(facets.points, axis=1, keepdims=True)
    assert (facets.normals * outward).sum(axis=1).min() > 0.99
    # Each octant holds an eighth: 2,500 with a deviation of 47.
    octant = (facets.points > 0.0) @ [1, 2, 4]
    assert np.abs(np.bincount(octant, minlength=8) - 2500).max() < 5 * 47
