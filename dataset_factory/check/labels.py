# SPDX-License-Identifier: Apache-2.0
"""Checks that labels, meshes and masks speak of the same thing in the same place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.render.cameras import Camera

#: How far a joint may lie outside the box around its person's mesh [m].
JOINT_MARGIN_M = 0.1
#: A mask may reach this far beyond its projected mesh [px].
MASK_MARGIN_PX = 2.0
#: A joint lies at most this deep under the surface that a camera sees [m].
JOINT_DEPTH_M = 0.35
#: No part of a person is faster: hands that throw a ball reach 40 m/s.
FASTEST_M_S = 50.0
#: Share of a person's visible joints that must lie on its mask; hands may slip off at the rim.
JOINTS_ON_MASK = 0.7


def label_faults(sequence: Sequence, frame: int) -> Iterator[str]:
    """One action and one skeleton per person, and each skeleton within its person's mesh."""
    file = sequence.files.geometry(frame)
    people, actions = sequence.people(frame), sequence.actions(frame)
    joints = sequence.joints(frame)
    velocity = sequence.segment_velocity(frame)
    if not len(people) == len(actions) == len(joints) == len(velocity):
        yield (
            f"{file}: {len(people)} persons, {len(actions)} actions, {len(joints)} skeletons and "
            f"{len(velocity)} sets of velocities; expected one of each per person"
        )
        return
    if (np.linalg.norm(velocity, axis=-1) > FASTEST_M_S).any():
        yield f"{file}: body segments faster than {FASTEST_M_S:g} m/s"
    vertices, faces, instance = sequence.moving_mesh(frame)
    for person, skeleton in zip(people, joints, strict=True):
        own = vertices[np.unique(faces[instance == person])]
        if not len(own):
            yield f"{file}: person {person} has no mesh"
            continue
        low, high = own.min(axis=0) - JOINT_MARGIN_M, own.max(axis=0) + JOINT_MARGIN_M
        if (skeleton < low).any() or (skeleton > high).any():
            yield f"{file}: joints of person {person} lie outside its mesh"


def mask_faults(sequence: Sequence, frame: int, camera_name: str) -> Iterator[str]:
    """Masks lie where the mesh is, and visible joints on their person's mask."""
    row = next(row for row in sequence.cameras if row["name"] == camera_name)
    camera, file = Camera.from_dict(row), sequence.files.mask(camera_name, frame)
    mask, depth_m = sequence.mask(camera_name, frame), sequence.depth(camera_name, frame)
    vertices, faces, instance = sequence.moving_mesh(frame)
    for number in np.unique(mask[mask > 0]):
        own = vertices[np.unique(faces[instance == number])]
        if _strays(camera, mask == number, own):
            yield f"{file}: instance {number} is seen where its mesh is not"
    for person, skeleton in zip(sequence.people(frame), sequence.joints(frame), strict=True):
        yield from _joint_faults(file, camera, mask, depth_m, int(person), skeleton)


def _strays(camera: Camera, seen: np.ndarray, vertices: np.ndarray) -> bool:
    """Whether pixels lie outside the box around projected vertices."""
    if not len(vertices):
        return True
    pixel, ahead = camera.project(vertices)
    if (ahead <= 0.0).any():
        # A mesh that reaches behind the camera has no box in the picture.
        return False
    rows, columns = np.nonzero(seen)
    where = np.stack([columns, rows], axis=1) + 0.5
    low, high = pixel.min(axis=0) - MASK_MARGIN_PX, pixel.max(axis=0) + MASK_MARGIN_PX
    return bool((where < low).any() or (where > high).any())


def _joint_faults(
    file: Path,
    camera: Camera,
    mask: np.ndarray,
    depth_m: np.ndarray,
    person: int,
    skeleton: np.ndarray,
) -> Iterator[str]:
    pixel, ahead_m = camera.project(skeleton)
    inside = (ahead_m > 0.0) & (pixel >= 0.0).all(axis=1)
    inside &= (pixel < [camera.width, camera.height]).all(axis=1)
    column, row = pixel[inside].astype(int).T
    # Something else well in front of a joint hides it.
    clear = depth_m[row, column] > ahead_m[inside] - JOINT_DEPTH_M
    near = [
        (mask[max(r - 1, 0) : r + 2, max(c - 1, 0) : c + 2] == person).any()
        for r, c in zip(row[clear], column[clear], strict=True)
    ]
    if len(near) >= 3 and np.mean(near) < JOINTS_ON_MASK:
        yield (
            f"{file}: {len(near) - sum(near)} of {len(near)} visible joints of person {person} "
            "lie off its mask"
        )
