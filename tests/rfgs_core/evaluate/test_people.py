# SPDX-License-Identifier: Apache-2.0
"""Bodies are matched with people, one by one, and keep them."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.evaluate.people import match_people, people_metrics, surface_centroids
from rfgs_core.evaluate.scene import Scene
from rfgs_core.pose.score import identity_kept

PEOPLE = {3: np.array([1.0, 1.0, 0.9]), 7: np.array([3.0, 1.0, 0.9])}
AXES = np.array([[3.0, 1.0], [1.0, 1.0]])


def voxels(*clusters: tuple[float, float, float, int]) -> np.ndarray:
    return np.concatenate([np.tile([x, y, z], (count, 1)) for x, y, z, count in clusters])


def test_centroids_are_those_of_surfaces_not_of_vertices() -> None:
    """A square of fine triangles on one half, and a second instance elsewhere."""
    vertices = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [2, 1, 0], [9, 9, 9]])
    faces = np.array([[0, 1, 4], [0, 4, 2], [0, 2, 3], [5, 5, 5], [1, 2, 5]])
    found = surface_centroids(vertices, faces, np.array([1, 1, 1, 4, 2]))
    # What has no area has no centroid.
    assert list(found) == [1, 2]
    np.testing.assert_allclose(found[1], [1.0, 1.0, 0.0])


def test_each_person_is_held_against_its_own_body() -> None:
    """Shares of voxels do not matter, and errors do not cancel."""
    predicted = voxels((3.1, 1.0, 0.9, 100), (0.9, 1.0, 0.9, 900))
    found = match_people(predicted, AXES, PEOPLE)
    assert (found.body, found.person) == ((0, 1), (7, 3))
    assert found.distance_m == pytest.approx((0.1, 0.1))
    metrics = people_metrics([found])
    assert metrics["centroid_m"] == pytest.approx(0.1)
    assert metrics["found"] == 1.0 and metrics["identity_kept"] == 1.0


def test_a_body_without_voxels_has_lost_its_person() -> None:
    one = match_people(voxels((3.0, 1.0, 0.9, 5)), AXES, PEOPLE)
    far = match_people(voxels((3.0, 1.0, 0.9, 5), (1.0, 1.7, 0.9, 5)), AXES, PEOPLE)
    metrics = people_metrics([one, far])
    assert metrics["found"] == pytest.approx(2 / 4)
    assert metrics["centroid_m"] == pytest.approx(0.7 / 3)
    nobody = match_people(np.zeros((0, 3)), AXES, PEOPLE)
    assert people_metrics([nobody])["centroid_m"] is None
    assert people_metrics([nobody])["found"] == 0.0


def test_bodies_that_swap_their_people_are_seen() -> None:
    there = match_people(voxels((3.0, 1.0, 0.9, 5), (1.0, 1.0, 0.9, 5)), AXES, PEOPLE)
    swapped = match_people(voxels((3.0, 1.0, 0.9, 5), (1.0, 1.0, 0.9, 5)), AXES[::-1], PEOPLE)
    assert people_metrics([there, swapped, there])["identity_kept"] == pytest.approx(4 / 6)
    assert identity_kept([[], []]) is None


def test_cars_and_chairs_that_move_are_nobody(surface_run) -> None:
    scene = Scene.of(surface_run)
    score = scene.score(1)
    there = scene.people(1, score)
    assert there is not None and there.present == 1
    for row in surface_run.sequence.info.instances:
        row["class"] = "vehicle"
    empty = scene.people(1, score)
    assert empty is not None and (empty.present, empty.person) == (0, ())
