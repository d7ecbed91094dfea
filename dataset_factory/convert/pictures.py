# SPDX-License-Identifier: Apache-2.0
"""What formats of pictures share: which picture is held out, and coloured points of the scene."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from rfgs_core.dataset import Sequence
from rfgs_core.evaluate.geometry import surface_samples
from rfgs_core.render.cameras import Camera
from rfgs_core.seeds import sub_seed

#: Points that start a reconstruction.
POINTS = 20_000
#: A point is seen if the depth picture agrees with its distance this well [m].
SEEN_WITHIN_M = 0.05
#: Colour of points that no camera sees.
GREY = 128


def pictures(
    sequence: Sequence, cameras: list[str] | None = None
) -> Iterator[tuple[dict[str, Any], int, bool]]:
    """Every picture of some cameras, or all, as camera row, frame and whether it is held out."""
    chosen = [row for row in sequence.cameras if cameras is None or row["name"] in cameras]
    rows = [(camera, frame) for frame in sequence.frames for camera in chosen]
    test_frames = sequence.splits["images"]["test_frames"]
    for camera, frame in tqdm(rows, desc="pictures", unit="picture"):
        yield camera, frame, camera["split"] == "test" or frame in test_frames


def copy_picture(sequence: Sequence, camera: str, frame: int, target: Path) -> None:
    """Copies a colour picture byte for byte, after looking whether it is whole.

    Raises:
        RfgsFormatError: The picture is missing or damaged.
    """
    sequence.image(camera, frame)
    target.parent.mkdir(exist_ok=True)
    shutil.copyfile(sequence.files.image(camera, frame), target)


def relative_time(sequence: Sequence, frame: int) -> float:
    """Time from 0 at the first frame to 1 at the last."""
    first, last = sequence.frames[0], sequence.frames[-1]
    return (frame - first) / max(last - first, 1)


def static_points(sequence: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Points on everything that stands still, coloured by the cameras of the first frame.

    Returns:
        Positions (point, 3) [m] and sRGB colours (point, 3), uint8; none without a room.
    """
    vertices, faces = sequence.static_mesh()
    if not len(faces):
        return np.zeros((0, 3)), np.zeros((0, 3), np.uint8)
    random = np.random.default_rng(sub_seed(0, sequence.name, "static points"))
    points, _ = surface_samples(vertices, faces, POINTS, random)
    total, count = np.zeros((len(points), 3)), np.zeros(len(points))
    frame = sequence.frames[0]
    for row in sequence.cameras:
        camera, name = Camera.from_dict(row), row["name"]
        pixel, ahead_m = camera.project(points)
        inside = (ahead_m > 0) & (pixel >= 0).all(axis=1)
        inside &= (pixel < [camera.width, camera.height]).all(axis=1)
        index = np.flatnonzero(inside)
        c, r = pixel[index].astype(int).T
        depth_m, mask = sequence.depth(name, frame)[r, c], sequence.mask(name, frame)[r, c]
        seen = (np.abs(depth_m - ahead_m[index]) < SEEN_WITHIN_M) & (mask == 0)
        total[index[seen]] += sequence.image(name, frame)[r, c, :3][seen]
        count[index[seen]] += 1
    colours = np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], GREY)
    return points, np.rint(colours).astype(np.uint8)
