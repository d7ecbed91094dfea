# SPDX-License-Identifier: Apache-2.0
"""What antennas see while something moves, against looking at every face afresh."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from rfgs_core.simulate.geometry import Sight, faces_of, surroundings
from rfgs_core.simulate.geometry.faces import Faces

ANTENNAS = np.array([[0.51, 0.83, 1.23], [3.27, 4.11, 2.07], [0.4, 4.4, 0.9]])
TURN = trimesh.transformations.rotation_matrix(0.3, [0.1, 0.3, 1.0])


def scene(x_m: float, cupboard_m: float = 2.9) -> tuple[Faces, np.ndarray]:
    """A room with a cupboard that stands and a turned box that has driven to x, and what moves."""
    room = trimesh.creation.box([4.0, 5.0, 2.6]).triangles + np.array([2.0, 2.5, 1.3])
    cupboard = trimesh.creation.box([0.5, 1.2, 1.8]).triangles + np.array([cupboard_m, 1.0, 0.9])
    # A sphere as well, so that the order of the faces by area depends on rounding.
    ball = trimesh.creation.icosphere(2, 0.3).triangles + np.array([x_m, 3.0, 0.3])
    box = trimesh.creation.box([0.8, 0.5, 1.0]).triangles
    driven = trimesh.transform_points(box.reshape(-1, 3), TURN).reshape(-1, 3, 3) + np.array(
        [x_m, 2.4, 0.7]
    )
    parts = [room, cupboard, driven, ball]
    mesh = np.repeat(np.arange(4), [len(part) for part in parts])
    triangles = np.concatenate(parts).astype(np.float32)
    return faces_of(triangles, mesh), mesh >= 2


@pytest.mark.parametrize("order", [(1.2, 1.9, 2.6), (2.6, 1.2, 1.2), (1.9,)])
def test_moving_faces_are_seen_as_if_nothing_was_kept(order: tuple[float, ...]) -> None:
    sight = Sight(ANTENNAS[:2], ANTENNAS[2:])
    for x_m in order:
        faces, moves = scene(x_m)
        found, afresh = sight.of(faces, moves), surroundings(faces, ANTENNAS[:2], ANTENNAS[2:])
        np.testing.assert_array_equal(found.tx_hidden, afresh.tx_hidden)
        np.testing.assert_array_equal(found.rx_hidden, afresh.rx_hidden)


def test_driving_changes_what_is_seen_of_what_stands() -> None:
    """Otherwise the test above would hold for one that never looks again."""
    sight = Sight(ANTENNAS[:2], ANTENNAS[2:])
    counts = [np.bincount(sight.of(*scene(x_m)).tx_hidden.ravel()) for x_m in (1.2, 2.6)]
    assert (counts[0] != counts[1]).any()


def test_furniture_that_was_moved_is_looked_at_again() -> None:
    sight = Sight(ANTENNAS[:2], ANTENNAS[2:])
    sight.of(*scene(1.2))
    faces, moves = scene(1.2, cupboard_m=1.4)
    afresh = surroundings(faces, ANTENNAS[:2], ANTENNAS[2:])
    np.testing.assert_array_equal(sight.of(faces, moves).tx_hidden, afresh.tx_hidden)
