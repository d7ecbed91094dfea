# SPDX-License-Identifier: Apache-2.0
"""Places of antennas: in the scene or just beside it, and in free air."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.mesh_ply import read_mesh, write_mesh
from rfgs_core.errors import RfgsError
from rfgs_core.predict.places import check_in_scene

#: A cupboard in the tiny dataset's room of 3 x 3 x 2.5 m, its walls of one sheet.
LOW_M, HIGH_M = (0.2, 0.3, 0.0), (0.8, 1.1, 2.0)
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))], np.int32)


@pytest.fixture
def furnished(tiny_dataset: Path, tmp_path: Path) -> Sequence:
    """The tiny dataset with the cupboard in its room, and another one without a door."""
    sequence = open_dataset(shutil.copytree(tiny_dataset, tmp_path / "dataset")).sequence()
    vertices, faces = read_mesh(sequence.files.static_mesh)
    closed = (np.array(LOW_M) + CORNERS * np.subtract(HIGH_M, LOW_M)).astype(np.float32)
    open_ = closed + np.float32([1.5, 0, 0])
    write_mesh(
        sequence.files.static_mesh,
        np.concatenate([vertices, closed, open_]),
        np.concatenate([faces, FACES + 8, FACES[2:] + 16]).astype(np.int32),
    )
    return sequence


def refusal(sequence: Sequence, place: tuple[float, float, float]) -> str:
    """What is said of a receiver there; nothing if it may stand there."""
    devices = np.array([device.position_m for device in sequence.devices("wifi")])
    named = [("--tx", np.array([1.5, 1.5, 1.0])), ("--rx", np.array(place))]
    try:
        check_in_scene(sequence, named, devices)
    except RfgsError as error:
        return str(error)
    return ""


def test_the_margin_is_a_metre_from_the_nearest_point_of_the_bounds(furnished: Sequence) -> None:
    assert refusal(furnished, (3.99, 1.0, 1.0)) == ""
    # A corner is farther away than each of its sides.
    assert "1.3 m outside" in refusal(furnished, (3.9, 3.9, 1.0))
    said = refusal(furnished, (-2.5, 1.0, 1.0))
    assert said.startswith("--rx -2.5,1,1: 2.5 m outside the scene, which reaches from 0,0,0 to 3,")


def test_places_just_outside_are_told(furnished: Sequence) -> None:
    below = ("--tx", np.array([1.5, 1.5, -0.5]))
    named = [below, ("--rx", np.array([3.04, 1.0, 1.0]))]
    (said,) = check_in_scene(furnished, named, np.zeros((0, 3)))
    assert (
        said == "--tx 1.5,1.5,-0.5: 0.5 m outside the scene, which reaches from 0,0,0 to 3,3,2.5 m"
    )


def test_only_closed_objects_have_an_inside_and_rooms_are_not_objects(furnished: Sequence) -> None:
    assert "inside an object that reaches from 0.2,0.3,0 to 0.8,1.1,2 m" in refusal(
        furnished, (0.5, 0.6, 1.0)
    )
    assert refusal(furnished, (0.5, 0.6, 2.1)) == ""
    # Nobody can tell what is inside the one without a door; all of them stand in the room.
    assert refusal(furnished, (2.0, 0.6, 1.0)) == ""


def test_what_a_device_stands_in_is_a_room(furnished: Sequence) -> None:
    place = np.array([0.5, 0.6, 1.0])
    check_in_scene(furnished, [("--tx", place)], place[None] + 0.1)


def test_a_dataset_without_geometry_tells_its_bounds_alone(furnished: Sequence) -> None:
    furnished.files.static_mesh.unlink()
    assert refusal(furnished, (0.5, 0.6, 1.0)) == ""
    assert "outside the scene" in refusal(furnished, (0.5, 0.6, 9.0))
