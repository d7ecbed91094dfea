# SPDX-License-Identifier: Apache-2.0
"""Depth and outline of triangle meshes through the cameras of a dataset, with a z-buffer.

Used where a picture of the true mesh is wanted without Blender: masks, silhouettes, checks that
cameras mean the same thing everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from jaxtyping import Float, Float32, Int, Int32

from rfgs_core.errors import RfgsFormatError
from rfgs_core.render.cameras import Camera

#: Triangles are cut at this planar depth [m].
NEAR_M = 0.01

#: Rounding allowed at an edge, in barycentric coordinates, so that neighbours leave no crack.
EDGE_SHARE = 1e-9

_NO_FACE = -1


@dataclass(frozen=True)
class MeshPicture:
    """What a camera sees of a mesh, sampled at pixel centres."""

    depth: Float32[np.ndarray, "H W"]
    """Planar depth [m], +inf where no triangle is."""
    face: Int32[np.ndarray, "H W"]
    """Nearest triangle, −1 where none is."""

    @property
    def mask(self) -> np.ndarray:
        """True where a triangle is, shape [H, W]."""
        return self.face >= 0

    def labels(self, of_face: np.ndarray, background: int = 0) -> np.ndarray:
        """A label per pixel from a label per face, for example the instance; shape [H, W]."""
        return np.where(self.mask, np.asarray(of_face)[self.face], background)


def rasterize_mesh(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"], camera: Camera
) -> MeshPicture:
    """Draws both sides of every triangle.

    Args:
        vertices: World coordinates [m].
        faces: Rows of `vertices`.
        camera: Where to look from.

    Returns:
        Depth and nearest triangle per pixel.

    Raises:
        RfgsFormatError: A face names a vertex that is not there, or a vertex is not finite.
    """
    faces = np.ascontiguousarray(faces, np.int64).reshape(-1, 3)
    points = np.asarray(vertices, np.float64).reshape(-1, 3)
    if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
        raise RfgsFormatError(
            f"mesh: faces name vertices {faces.min()}..{faces.max()}, there are {len(points)}"
        )
    if not np.isfinite(points).all():
        raise RfgsFormatError("mesh: a vertex is not finite")
    inverse_depth = np.zeros((camera.height, camera.width))
    face = np.full((camera.height, camera.width), _NO_FACE, np.int32)
    optics = np.array([camera.fl_x, camera.fl_y, camera.cx, camera.cy])
    _draw(inverse_depth, face, camera.to_view(points), faces, optics)
    depth = np.full(face.shape, np.inf, np.float32)
    depth[face >= 0] = 1.0 / inverse_depth[face >= 0]
    return MeshPicture(depth=depth, face=face)


@numba.njit(cache=True)
def _draw(
    inverse_depth: np.ndarray,  # [H, W], zero on entry
    face: np.ndarray,  # [H, W]
    view: np.ndarray,  # [V, 3], view axes
    faces: np.ndarray,  # [T, 3]
    optics: np.ndarray,  # fl_x, fl_y, cx, cy
) -> None:
    corners = np.zeros((3, 3))
    polygon = np.zeros((4, 3))
    for index in range(faces.shape[0]):
        for corner in range(3):
            corners[corner] = view[faces[index, corner]]
        count = _clip_near(corners, polygon)
        for corner in range(count):
            # (x, y, z) becomes (column, row, 1/z); 1/z is linear in the picture.
            z = polygon[corner, 2]
            polygon[corner, 0] = optics[0] * polygon[corner, 0] / z + optics[2]
            polygon[corner, 1] = optics[1] * polygon[corner, 1] / z + optics[3]
            polygon[corner, 2] = 1.0 / z
        for corner in range(2, count):
            _draw_triangle(
                inverse_depth, face, polygon[0], polygon[corner - 1], polygon[corner], index
            )


@numba.njit(cache=True)
def _clip_near(corners: np.ndarray, polygon: np.ndarray) -> int:
    """Cuts a triangle at the near plane; returns how many corners of `polygon` are left."""
    count = 0
    for corner in range(3):
        here, there = corners[corner], corners[(corner + 1) % 3]
        if here[2] >= NEAR_M:
            polygon[count] = here
            count += 1
        if (here[2] >= NEAR_M) != (there[2] >= NEAR_M):
            share = (NEAR_M - here[2]) / (there[2] - here[2])
            polygon[count] = here + share * (there - here)
            count += 1
    return count


@numba.njit(cache=True)
def _draw_triangle(
    inverse_depth: np.ndarray,
    face: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    index: int,
) -> None:
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area == 0.0:
        return
    height, width = face.shape
    left = max(0.0, np.floor(min(a[0], b[0], c[0]) - 0.5))
    right = min(float(width), np.ceil(max(a[0], b[0], c[0]) + 0.5))
    top = max(0.0, np.floor(min(a[1], b[1], c[1]) - 0.5))
    bottom = min(float(height), np.ceil(max(a[1], b[1], c[1]) + 0.5))
    for row in range(int(top), int(bottom)):
        y = row + 0.5
        for column in range(int(left), int(right)):
            x = column + 0.5
            of_a = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
            of_b = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
            of_c = 1.0 - of_a - of_b
            if min(of_a, of_b, of_c) < -EDGE_SHARE:
                continue
            nearness = of_a * a[2] + of_b * b[2] + of_c * c[2]
            if nearness > inverse_depth[row, column]:
                inverse_depth[row, column] = nearness
                face[row, column] = index
