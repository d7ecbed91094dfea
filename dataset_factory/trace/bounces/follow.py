# SPDX-License-Identifier: Apache-2.0
"""Paths by way of walls and a point that has moved since they were traced.

Which walls a path meets is held from the trace; its corners, length and amplitude are those of
the point's new place. Walls are plane and stand still, so each end of the path sees one mirror
image of the point, and that image moves as the point does, mirrored: lengths are exact.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rfgs_core.radio.images import SCATTERING
from rfgs_core.simulate.paths.path_set import PathSet


def follow(paths: PathSet, places: np.ndarray) -> PathSet:
    """The paths when their points have moved.

    Args:
        paths: Paths with one sensing interaction each, all others specular or straight, as
            `Bounces.paths` gives them.
        places: Where the points are now [m], shape (point, 3).

    Returns:
        The same paths in the same order, amplitudes scaled by the spreading of both legs.
    """
    if not len(paths):
        return paths
    rows, depth = np.arange(len(paths)), paths.kinds.shape[1]
    at = np.argmax(paths.kinds == SCATTERING, axis=1)
    count = (paths.kinds != 0).sum(axis=1)
    place = places[paths.primitives[rows, at]]
    shift = place - paths.vertices[rows, at + 1]
    step = np.arange(depth + 1)
    # Corners and kinds of each leg as they follow from its device; the point closes both legs.
    from_tx = np.minimum(step, at[:, None] + 1)
    from_rx = np.maximum(count[:, None] + 1 - step, at[:, None] + 1)
    vertices, amplitude = paths.vertices.copy(), paths.amplitude
    for order, walls in ((from_tx, at), (from_rx, count - at - 1)):
        corners = np.take_along_axis(paths.vertices, order[:, :, None], axis=1)
        kind = np.minimum(np.maximum(order[:, 1:] - 1, 0), depth - 1)
        mirrors = np.take_along_axis(paths.mirrors(), kind, axis=1)
        moved, spread = _leg(corners, mirrors, walls, shift)
        amplitude = amplitude * spread[:, None, None]
        for i in range(depth - 1):
            used = i < walls
            vertices[rows[used], order[used, i + 1]] = moved[used, i]
    vertices[rows, at + 1] = place
    return replace(paths, vertices=vertices, amplitude=amplitude)


def _leg(
    corners: np.ndarray, mirrors: np.ndarray, walls: np.ndarray, shift: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Moves the far end of legs from devices by way of walls to points.

    Args:
        corners: Device, walls, then the point, repeated [m], shape (path, walls + 2, 3).
        mirrors: Whether each wall mirrors, else it is crossed, shape (path, walls + 1).
        walls: Walls of each leg, shape (path,).
        shift: How far each point has moved [m], shape (path, 3).

    Returns:
        Corners on the walls [m], shape (path, walls, 3), and the ratio of old to new length.
    """
    ways = np.diff(corners, axis=1)
    length = np.linalg.norm(ways, axis=2)
    k = ways / np.maximum(length, 1e-12)[:, :, None]
    total = length.sum(axis=1)
    normals = _wall_normals(k, mirrors, walls)
    image_shift = shift
    for i in range(normals.shape[1] - 1, -1, -1):
        image_shift = _reflected(image_shift, normals[:, i])
    way = total[:, None] * k[:, 0] + image_shift
    new_total = np.linalg.norm(way, axis=1)
    direction, here = way / new_total[:, None], corners[:, 0]
    moved = np.empty_like(normals)
    for i in range(moved.shape[1]):
        normal = normals[:, i]
        across = np.sum(normal * direction, axis=1)
        bends = np.abs(across) > 1e-12
        to_wall = np.sum(normal * (corners[:, i + 1] - here), axis=1) / np.where(bends, across, 1.0)
        # A wall that is crossed bends nothing: any place on the straight line will do.
        run = np.where(bends, to_wall, length[:, i] * new_total / total)
        here = here + run[:, None] * direction
        moved[:, i] = here
        direction = _reflected(direction, normal)
    return moved, total / new_total


def _wall_normals(k: np.ndarray, mirrors: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Unit normals of mirroring walls, zero for others, shape (path, walls, 3)."""
    normal = k[:, 1:] - k[:, :-1]
    size = np.linalg.norm(normal, axis=2)
    bends = mirrors[:, : normal.shape[1]] & (size > 1e-9)
    bends &= np.arange(normal.shape[1]) < walls[:, None]
    return np.where(bends[:, :, None], normal / np.maximum(size, 1e-12)[:, :, None], 0.0)


def _reflected(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Vectors mirrored in planes of unit normals; a zero normal leaves them as they are."""
    return vectors - 2.0 * np.sum(vectors * normals, axis=1, keepdims=True) * normals
