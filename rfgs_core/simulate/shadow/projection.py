# SPDX-License-Identifier: Apache-2.0
"""A mesh flattened onto the plane across one segment of a path."""

from __future__ import annotations

import math

import numba
import numpy as np

#: Vertices nearer to the ends of a segment than this are not between them [m].
_MARGIN_M = 1e-3


@numba.njit(cache=True)
def project(
    vertices: np.ndarray, start: np.ndarray, end: np.ndarray, before_m: float, after_m: float
) -> tuple[np.ndarray, float, float, np.ndarray]:
    """Flattens a mesh onto the plane across a segment, each vertex at its own Fresnel scale.

    Args:
        vertices: Vertices [m], shape (3, V), for vector code.
        start: Start of the segment [m].
        end: End of the segment [m].
        before_m: Length of the unfolded path before the segment [m].
        after_m: Length after the segment [m].

    Returns:
        Plane coordinates at the mean depth [m], no numbers where a vertex does not lie between the
        ends, shape (2, V); the depth of the plane from the segment's start [m]; 1/d_1 + 1/d_2
        there, 0 if no vertex lies between [1/m]; and the two axes of the plane, shape (2, 3).
    """
    way = end - start
    length = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    u = way / length
    axes = np.zeros((2, 3))
    # Horizontal first axis, so that rows of a standing person are level; any if u is vertical.
    flat = math.sqrt(u[0] * u[0] + u[1] * u[1])
    if flat > 1e-6:
        axes[0, 0], axes[0, 1] = -u[1] / flat, u[0] / flat
    else:
        axes[0, 0] = 1.0
    axes[1, 0] = u[1] * axes[0, 2] - u[2] * axes[0, 1]
    axes[1, 1] = u[2] * axes[0, 0] - u[0] * axes[0, 2]
    axes[1, 2] = u[0] * axes[0, 1] - u[1] * axes[0, 0]
    xy = np.zeros((2, vertices.shape[1]))
    depths = (before_m, length, after_m)
    depth_sum, count = _flatten(
        vertices,
        (start[0], start[1], start[2]),
        ((axes[0, 0], axes[0, 1], axes[0, 2]), (axes[1, 0], axes[1, 1], axes[1, 2])),
        (u[0], u[1], u[2]),
        depths,
        xy,
    )
    if count == 0.0:
        return xy, 0.0, 0.0, axes
    plane = depth_sum / count
    at_plane = 1.0 / (before_m + plane) + 1.0 / (after_m + length - plane)
    xy *= 1.0 / math.sqrt(at_plane)
    return xy, plane, at_plane, axes


@numba.njit(forceinline=True, cache=True, fastmath={"contract", "reassoc"}, error_model="numpy")
def _flatten(
    vertices: np.ndarray,
    start: tuple[float, float, float],
    axes: tuple[tuple[float, float, float], tuple[float, float, float]],
    u: tuple[float, float, float],
    depths: tuple[float, float, float],
    xy: np.ndarray,
) -> tuple[float, float]:
    """Fills in plane coordinates times √(1/d_1 + 1/d_2) of each vertex; sum and count of depths."""
    (ax, ay, az), (bx, by, bz), (ux, uy, uz) = axes[0], axes[1], u
    before_m, length, after_m = depths
    low, high = _MARGIN_M, length - _MARGIN_M
    depth_sum, count = 0.0, 0.0
    for i in range(vertices.shape[1]):
        x, y, z = vertices[0, i] - start[0], vertices[1, i] - start[1], vertices[2, i] - start[2]
        depth = x * ux + y * uy + z * uz
        between = (depth > low) & (depth < high)
        inside = depth if between else 0.5 * length
        scale = math.sqrt(1.0 / (before_m + inside) + 1.0 / (after_m + length - inside))
        depth_sum += depth if between else 0.0
        count += 1.0 if between else 0.0
        xy[0, i] = (x * ax + y * ay + z * az) * scale if between else np.nan
        xy[1, i] = (x * bx + y * by + z * bz) * scale if between else np.nan
    return depth_sum, count
