# SPDX-License-Identifier: Apache-2.0
"""The silhouette of a mesh as seen along one straight segment, cut into rows."""

from __future__ import annotations

import math

import numba
import numpy as np

#: Height of the rows that a silhouette is cut into, in Fresnel coordinates; level edges are off
#: by half of it, which is 0.003 of a path past a person.
ROW = 0.02
#: Fewest and most rows.
LEAST_ROWS, MOST_ROWS = 40, 2048
#: Beyond this coordinate a silhouette counts as unbounded.
WINDOW = 20.0


@numba.njit(cache=True)
def project(
    vertices: np.ndarray, start: np.ndarray, end: np.ndarray, before_m: float, after_m: float
) -> tuple[np.ndarray, np.ndarray, float, float, np.ndarray]:
    """Flattens a mesh onto the plane across a segment, each vertex at its own Fresnel scale.

    Args:
        vertices: Vertices [m], shape (V, 3).
        start: Start of the segment [m].
        end: End of the segment [m].
        before_m: Length of the unfolded path before the segment [m].
        after_m: Length after the segment [m].

    Returns:
        Plane coordinates at the mean depth [m], shape (V, 2); which vertices lie between the
        ends; the depth of the plane from the segment's start [m]; 1/d_1 + 1/d_2 there [1/m];
        and the two axes of the plane, shape (2, 3).
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
    flat_xy = np.zeros((len(vertices), 2))
    scale = np.zeros(len(vertices))
    between = np.zeros(len(vertices), dtype=np.bool_)
    margin = 1e-3
    depth_sum, count = 0.0, 0
    for i in range(len(vertices)):
        x = vertices[i, 0] - start[0]
        y = vertices[i, 1] - start[1]
        z = vertices[i, 2] - start[2]
        depth = x * u[0] + y * u[1] + z * u[2]
        if depth <= margin or depth >= length - margin:
            continue
        between[i] = True
        depth_sum += depth
        count += 1
        scale[i] = 1.0 / (before_m + depth) + 1.0 / (after_m + length - depth)
        flat_xy[i, 0] = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        flat_xy[i, 1] = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
    if count == 0:
        return flat_xy, between, 0.0, 0.0, axes
    plane = depth_sum / count
    at_plane = 1.0 / (before_m + plane) + 1.0 / (after_m + length - plane)
    for i in range(len(vertices)):
        factor = math.sqrt(scale[i] / at_plane)
        flat_xy[i, 0] *= factor
        flat_xy[i, 1] *= factor
    return flat_xy, between, plane, at_plane, axes


@numba.njit(cache=True)
def _box(
    xy: np.ndarray, between: np.ndarray, window: float
) -> tuple[float, float, float, float, float]:
    """Clipped extent (x, y from and to) and the distance of the extent from the path [m]."""
    x0, x1, y0, y1 = math.inf, -math.inf, math.inf, -math.inf
    for i in range(len(xy)):
        if between[i]:
            x0, x1 = min(x0, xy[i, 0]), max(x1, xy[i, 0])
            y0, y1 = min(y0, xy[i, 1]), max(y1, xy[i, 1])
    off_x, off_y = max(x0, -x1, 0.0), max(y0, -y1, 0.0)
    distance = math.sqrt(off_x * off_x + off_y * off_y)
    return max(x0, -window), min(x1, window), max(y0, -window), min(y1, window), distance


@numba.njit(cache=True)
def _contour(
    xy: np.ndarray,
    between: np.ndarray,
    faces: np.ndarray,
    edge_of: np.ndarray,
    count: int,
) -> np.ndarray:
    """How many more triangles lie to the left of each edge than to its right, int64, shape (E,).

    Every triangle counts, whichever side it shows. An edge between two that lie side by side has
    none: only contours and folds are left, a tenth of all edges or less.
    """
    more = np.zeros(count, dtype=np.int64)
    for t in range(len(faces)):
        a, b, c = faces[t]
        if not (between[a] and between[b] and between[c]):
            continue
        area = (xy[b, 0] - xy[a, 0]) * (xy[c, 1] - xy[a, 1])
        area -= (xy[b, 1] - xy[a, 1]) * (xy[c, 0] - xy[a, 0])
        if area == 0.0:
            continue
        side = 1 if area > 0.0 else -1
        for k in range(3):
            edge = edge_of[t, k]
            more[edge >> 1] += -side if edge & 1 else side
    return more


@numba.njit(cache=True)
def _crossings(
    xy: np.ndarray, edges: np.ndarray, more: np.ndarray, y0: float, pitch: float, rows: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where contours cross the middle of rows: offsets (rows + 1), x [m] and what is entered."""
    offsets = np.zeros(rows + 1, dtype=np.int64)
    for filling in range(2):
        if filling:
            x = np.zeros(offsets[rows])
            entered = np.zeros(offsets[rows], dtype=np.int64)
            filled = offsets[:-1].copy()
        for e in range(len(edges)):
            if more[e] == 0:
                continue
            a, b = edges[e]
            ya, yb = (xy[a, 1] - y0) / pitch - 0.5, (xy[b, 1] - y0) / pitch - 0.5
            first = max(math.ceil(min(ya, yb)), 0)
            # An edge that ends at the middle of a row is left to the one that begins there.
            last = min(math.ceil(max(ya, yb)) - 1, rows - 1)
            for row in range(first, last + 1):
                if not filling:
                    offsets[row + 1] += 1
                    continue
                at = filled[row]
                x[at] = xy[a, 0] + (row - ya) / (yb - ya) * (xy[b, 0] - xy[a, 0])
                entered[at] = more[e] if yb < ya else -more[e]
                filled[row] += 1
        if not filling:
            for row in range(rows):
                offsets[row + 1] += offsets[row]
    return offsets, x, entered


@numba.njit(cache=True)
def _covered(x: np.ndarray, entered: np.ndarray, window: float, runs: np.ndarray) -> int:
    """Fills in where at least one triangle covers a row, clipped ends pushed to infinity.

    Args:
        x: Crossings of the row [m], shape (crossing,); sorted in place.
        entered: How many triangles each of them enters, negative where it leaves; sorted along.
        window: Half width beyond which the silhouette counts as unbounded [m].
        runs: Filled, ascending and disjoint, shape (crossing / 2, 2) or longer.

    Returns:
        Number of runs.
    """
    for i in range(1, len(x)):
        at, enters, k = x[i], entered[i], i - 1
        # Where one ends and another begins there is no gap.
        while k >= 0 and (x[k] > at or (x[k] == at and entered[k] < enters)):
            x[k + 1], entered[k + 1] = x[k], entered[k]
            k -= 1
        x[k + 1], entered[k + 1] = at, enters
    count, depth = 0, 0
    for i in range(len(x)):
        if depth == 0:
            runs[count, 0] = -math.inf if x[i] <= -window else x[i]
        depth += entered[i]
        if depth == 0:
            runs[count, 1] = math.inf if x[i] >= window else x[i]
            count += runs[count, 1] > runs[count, 0]
    return count


@numba.njit(cache=True)
def runs_of(
    xy: np.ndarray,
    between: np.ndarray,
    mesh: tuple[np.ndarray, np.ndarray, np.ndarray],
    window: float,
    far: float,
    pitch: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Silhouette as runs.

    Args:
        xy: Plane coordinates [m], shape (V, 2).
        between: Which vertices count, shape (V,).
        mesh: Triangles, edges and edges of the triangles, see `ShadowMesh`.
        window: Half width beyond which the silhouette counts as unbounded [m].
        far: Distance beyond which there is no silhouette [m].
        pitch: Largest height of a row, within the limits of their number [m].

    Returns:
        Runs (x from, x to) and the lower and upper y of their rows [m], each shape (N, 2).
    """
    nothing = np.zeros((0, 2))
    if not between.any():
        return nothing, nothing
    x0, x1, y0, y1, distance = _box(xy, between, window)
    if distance > far or x1 <= x0 or y1 <= y0:
        return nothing, nothing
    rows = min(max(math.ceil((y1 - y0) / pitch), LEAST_ROWS), MOST_ROWS)
    pitch = (y1 - y0) / rows
    faces, edges, edge_of = mesh
    more = _contour(xy, between, faces, edge_of, len(edges))
    offsets, x, entered = _crossings(xy, edges, more, y0, pitch, rows)
    runs, heights = np.zeros((len(x) // 2 + 1, 2)), np.zeros((len(x) // 2 + 1, 2))
    count = 0
    for row in range(rows):
        here = slice(offsets[row], offsets[row + 1])
        end = count + _covered(x[here], entered[here], window, runs[count:])
        low, high = y0 + row * pitch, y0 + (row + 1) * pitch
        if row == 0 and y0 <= -window:
            low = -math.inf
        if row == rows - 1 and y1 >= window:
            high = math.inf
        for i in range(count, end):
            heights[i, 0], heights[i, 1] = low, high
        count = end
    return runs[:count], heights[:count]


@numba.njit(cache=True)
def farthest(
    runs: np.ndarray, heights: np.ndarray, shifts: np.ndarray
) -> tuple[float, float, float]:
    """Distances of the farthest edges within bounds from any of the lines' crossings [m].

    Args:
        runs: As `runs_of` gives them.
        heights: Likewise.
        shifts: Where lines cross the plane [m], rows x and y, shape (2, line).

    Returns:
        Along x, along y, and that of the farthest corner.
    """
    far_x, far_y, corner = 0.0, 0.0, 0.0
    ways = np.abs(shifts[0]).max(), np.abs(shifts[1]).max()
    for i in range(len(runs)):
        across, along = 0.0, 0.0
        for x in runs[i]:
            if math.isfinite(x):
                across = max(across, abs(x) + ways[0])
        for y in heights[i]:
            if math.isfinite(y):
                along = max(along, abs(y) + ways[1])
        far_x, far_y = max(far_x, across), max(far_y, along)
        corner = max(corner, math.sqrt(across * across + along * along))
    return far_x, far_y, corner


@numba.njit(cache=True)
def covers(runs: np.ndarray, heights: np.ndarray) -> bool:
    """Whether the path itself, at the origin of the plane, is hidden."""
    for i in range(len(runs)):
        if heights[i, 0] <= 0.0 < heights[i, 1] and runs[i, 0] <= 0.0 < runs[i, 1]:
            return True
    return False
