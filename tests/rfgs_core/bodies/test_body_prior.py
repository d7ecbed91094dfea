# SPDX-License-Identifier: Apache-2.0
"""Where the surface of one who stands or sits is likely, and how it faces."""

from __future__ import annotations

import numpy as np

from rfgs_core.bodies.body_prior import Bodies, outward_normals, surface_prior

EAST, NORTH = 0.0, np.pi / 2


def test_who_stands_is_one_upright_limb() -> None:
    """Gaussian of 0.2 m around the axis; a half Gaussian of 0.08 m above 1.6 m."""
    bodies = Bodies.standing(np.array([[0.7, 0.7]]))
    places = np.array([[0.7, 0.7, 1.0], [0.9, 0.7, 1.0], [0.7, 0.3, 0.2], [0.7, 0.7, 1.76]])
    got = surface_prior(places, bodies)[0]
    np.testing.assert_allclose(got, [0, -0.5, -2.0, -2.0], atol=1e-6)


def test_normals_point_away_from_the_nearest_axis() -> None:
    bodies = Bodies.standing(np.array([[0.0, 0.0], [3.0, 0.0]]))
    points = np.array([[0.5, 0.0, 1.0], [2.0, 0.0, 1.0], [3.0, 2.0, 0.3], [0.0, 0.0, 1.0]])
    normals = outward_normals(points, bodies)
    np.testing.assert_allclose(normals, [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 0]], atol=1e-12)


def test_who_sits_has_a_trunk_on_a_seat_thighs_and_shins() -> None:
    bodies = Bodies(np.array([[1.0, 2.0]]), np.array([EAST]))
    trunk, thigh, shin = [1.0, 2.0, 1.1], [1.3, 2.1, 0.5], [1.42, 1.9, 0.2]
    got = surface_prior(np.array([trunk, thigh, shin]), bodies)[0]
    np.testing.assert_allclose(got, 0.0, atol=1e-9)
    # One deviation above the head; beside a thigh, above it, and before a shin.
    off = np.array([[1.0, 2.0, 1.38], [1.3, 2.19, 0.5], [1.3, 2.1, 0.59], [1.5, 1.9, 0.2]])
    np.testing.assert_allclose(surface_prior(off, bodies)[0], -0.5, atol=1e-6)
    standing = surface_prior(np.array([[1.42, 1.9, 0.2]]), Bodies.standing(bodies.axes_xy))[0]
    assert standing < -2.0


def test_a_thigh_faces_up_and_aside_and_a_shin_does_not_face_up() -> None:
    bodies = Bodies(np.array([[1.0, 2.0]]), np.array([EAST]))
    points = np.array([[1.2, 2.1, 0.58], [1.2, 2.17, 0.5], [1.5, 2.1, 0.2]])
    normals = outward_normals(points, bodies)
    np.testing.assert_allclose(normals, [[0, 0, 1], [0, 1, 0], [1, 0, 0]], atol=1e-9)


def test_knees_turn_the_body_around_its_axis() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-0.8, -0.8, 0.0], [0.8, 0.8, 1.7], (200, 3))
    turned = points[:, [1, 0, 2]] * [-1, 1, 1]
    ahead = Bodies(np.zeros((1, 2)), np.array([EAST]))
    left = Bodies(np.zeros((1, 2)), np.array([NORTH]))
    log, normals = surface_prior(points, ahead)
    log_turned, normals_turned = surface_prior(turned, left)
    np.testing.assert_allclose(log_turned, log, atol=1e-9)
    np.testing.assert_allclose(normals_turned, normals[:, [1, 0, 2]] * [-1, 1, 1], atol=1e-9)


def test_each_body_holds_itself_as_it_does() -> None:
    axes = np.array([[0.0, 0.0], [3.0, 0.0]])
    both = Bodies(axes, np.array([np.nan, NORTH]))
    assert both.sits.tolist() == [False, True] and len(both) == 2
    points = np.array([[0.1, 0.4, 0.5], [3.1, 0.4, 0.5], [0.0, 0.0, 1.5], [3.0, 0.0, 1.5]])
    got = surface_prior(points, both)[0]
    one, other = (surface_prior(points, both.only(body))[0] for body in (0, 1))
    np.testing.assert_array_equal(got, [one[0], other[1], one[2], other[3]])
