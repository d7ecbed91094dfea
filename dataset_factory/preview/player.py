# SPDX-License-Identifier: Apache-2.0
"""What the page's player shows: pictures with skeletons beside a plan of the scene."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial import ConvexHull

from dataset_factory.preview.pictures import over_backdrop
from rfgs_core.dataset import Sequence
from rfgs_core.evaluate.geometry import surface_samples
from rfgs_core.radio.layout import rotation
from rfgs_core.render.cameras import Camera
from rfgs_core.skeleton import PARENTS

#: Frames the player steps through, evenly spread over longer sequences.
MOST_FRAMES = 60
#: Pixels of the plan per metre, and the slice of the scene it shows above the floor [m].
PLAN_PX_PER_M = 40
PLAN_SLICE_M = (0.1, 2.0)
PLAN_SAMPLES = 150_000


def player(sequence: Sequence, has: list[str]) -> dict[str, Any]:
    """Everything the page's script needs, ready for JSON."""
    count = min(MOST_FRAMES, len(sequence.frames))
    chosen = np.linspace(0, len(sequence.frames) - 1, count).round().astype(int)
    frames = [sequence.frames[index] for index in chosen]
    cameras = sequence.cameras if "images" in has else []
    return {
        "frames": frames,
        "times": [sequence.time_s(frame) for frame in frames],
        "parents": list(PARENTS),
        "joints": [[_skeleton(person) for person in sequence.joints(frame)] for frame in frames],
        "outlines": [_outlines(sequence, frame) for frame in frames],
        "actions": [sequence.actions(frame) for frame in frames],
        "cameras": [_camera(sequence, row, frames) for row in cameras[:4]],
    }


def _skeleton(joints: np.ndarray) -> list[Any]:
    """Joints from above; none where the scene does not tell them."""
    return _rounded(joints[:, :2]) if np.isfinite(joints).all() else []


def _outlines(sequence: Sequence, frame: int) -> list[list[Any]]:
    """Outlines from above of what moves and is no person [m], as closed polygons."""
    vertices, faces, instance = sequence.moving_mesh(frame)
    people = {int(row["id"]) for row in sequence.instances if row["class"] == "person"}
    outlines = []
    for other in sorted(set(instance.tolist()) - people):
        above = vertices[np.unique(faces[instance == other]), :2].astype(np.float64)
        points = np.unique(np.round(above, 3), axis=0)
        if len(points) > 2:
            # Joggled (QJ), as what moves may be flat.
            outlines.append(_rounded(points[ConvexHull(points, qhull_options="QJ").vertices]))
    return outlines


def plan(sequence: Sequence) -> dict[str, Any]:
    """The scene from above: bounds, a shaded ground plan, devices and cameras [m]."""
    low, high = sequence.bounds_m
    devices = [
        {"radio": radio, "name": device.name, **_pose(device.position_m, device.quat_wxyz)}
        for radio in sequence.radios
        for device in sequence.devices(radio)
    ]
    return {
        "low": _rounded(low[:2]),
        "size": _rounded((high - low)[:2]),
        "ground": _ground(sequence),
        "devices": devices,
        "cameras": [_view(row) for row in sequence.cameras],
    }


def _camera(sequence: Sequence, row: dict[str, Any], frames: list[int]) -> dict[str, Any]:
    camera, pictures, skeletons = Camera.from_dict(row), [], []
    for frame in frames:
        stream = io.BytesIO()
        colours = np.rint(255 * over_backdrop(sequence.image(row["name"], frame)))
        Image.fromarray(colours.astype(np.uint8)).save(stream, "JPEG", quality=88)
        pictures.append("data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode())
        people = [camera.project(joints) for joints in sequence.joints(frame)]
        skeletons.append([_rounded(pixel) if (z > 0).all() else [] for pixel, z in people])
    return {
        "name": row["name"],
        "width": row["width"],
        "height": row["height"],
        "pictures": pictures,
        "skeletons": skeletons,
    }


def _ground(sequence: Sequence) -> str:
    """Data URI of a picture that is darker where more surface stands over the floor."""
    low, high = sequence.bounds_m
    vertices, faces = sequence.static_mesh()
    random = np.random.default_rng(0)
    points = np.zeros((0, 3))
    if len(faces):  # Without a room the plan is blank.
        points, _ = surface_samples(vertices, faces, PLAN_SAMPLES, random)
    above = points[:, 2] - low[2]
    points = points[(above > PLAN_SLICE_M[0]) & (above < PLAN_SLICE_M[1])]
    cells = np.maximum(np.ceil((high - low)[:2] * PLAN_PX_PER_M / 2), 1).astype(int)
    limits = [(low[axis] - 1e-3, high[axis] + 1e-3) for axis in (0, 1)]
    count, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=cells, range=limits)
    shade = 1.0 - np.exp(-count / max(float(np.percentile(count, 97)), 1.0))
    pixels = np.zeros((cells[1], cells[0], 4), np.uint8)
    pixels[..., :3] = (91, 101, 117)
    pixels[..., 3] = np.rint(255 * shade.T[::-1])
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def _pose(position_m: tuple[float, ...], quat_wxyz: tuple[float, ...]) -> dict[str, Any]:
    ahead = rotation(quat_wxyz)[:, 0]  # type: ignore[arg-type]
    return {
        "at": _rounded(np.array(position_m[:2])),
        "height": round(position_m[2], 2),
        "ahead": _rounded(ahead[:2]),
    }


def _view(row: dict[str, Any]) -> dict[str, Any]:
    matrix = np.asarray(row["world_from_camera"])
    ahead = -matrix[:2, 2]
    half_rad = np.arctan(0.5 * row["width"] / row["fl_x"])
    return {
        "name": row["name"],
        "at": _rounded(matrix[:2, 3]),
        "ahead": _rounded(ahead / max(float(np.linalg.norm(ahead)), 1e-9)),
        "half_deg": round(float(np.degrees(half_rad)), 1),
    }


def _rounded(values: np.ndarray) -> list[Any]:
    return np.round(np.asarray(values, np.float64), 3).tolist()
