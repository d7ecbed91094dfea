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
def _box(xy: np.ndarray, window: float) -> tuple[float, float, float, float, float]:
    """Clipped extent (x, y from and to) and the distance of the extent from the path [m]."""
    x0, x1, y0, y1 = math.inf, -math.inf, math.inf, -math.inf
    for i in range(xy.shape[1]):
        # Comparisons with no number are false.
        x, y = xy[0, i], xy[1, i]
        x0, x1 = (x if x < x0 else x0), (x if x > x1 else x1)
        y0, y1 = (y if y < y0 else y0), (y if y > y1 else y1)
    off_x, off_y = max(x0, -x1, 0.0), max(y0, -y1, 0.0)
    distance = math.sqrt(off_x * off_x + off_y * off_y)
    return max(x0, -window), min(x1, window), max(y0, -window), min(y1, window), distance


@numba.njit(cache=True)
def _contour(
    xy: np.ndarray, mesh: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Edges with more triangles on one side than on the other.

    Every triangle counts, whichever side it shows. An edge between two that lie side by side has
    as many on either: only contours and folds are found, a tenth of all edges or less.

    Returns:
        Vertices of the edges, uint32, shape (found, 2), and how many more triangles lie to the
        left of each, int8, shape (found,).
    """
    faces, edges, sides = mesh
    px, py = xy[0], xy[1]
    side = np.zeros(len(faces) + 1, dtype=np.int8)
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        area = (px[b] - px[a]) * (py[c] - py[a]) - (py[b] - py[a]) * (px[c] - px[a])
        side[t] = np.int8(area > 0.0) - np.int8(area < 0.0)
    found, more = np.zeros(len(sides), dtype=np.uint32), np.zeros(len(sides), dtype=np.int8)
    count = 0
    for e in range(len(sides)):
        found[count] = e
        more[count] = side[sides[e, 0]] - side[sides[e, 1]]
        count += more[count] != 0
    some = np.zeros((count, 2), dtype=np.uint32)
    for e in range(count):
        some[e, 0], some[e, 1] = edges[found[e], 0], edges[found[e], 1]
    return some, more[:count]


@numba.njit(cache=True, error_model="numpy")
def _crossings(
    xy: np.ndarray, edges: np.ndarray, more: np.ndarray, y0: float, pitch: float, rows: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where contours cross the middle of rows: offsets (rows + 1), x [m] and what is entered.

    Args:
        xy: Plane coordinates [m], shape (2, V).
        edges: Vertices of the contour's edges, shape (edge, 2).
        more: How many more triangles lie to the left of each, shape (edge,).
        y0: Lower end of the rows [m].
        pitch: Their height [m].
        rows: Their number.
    """
    per_m = 1.0 / pitch
    begin, end = _rows_of(xy[1], edges, (y0, per_m), rows)
    offsets = np.zeros(rows + 1, dtype=np.int64)
    for e in range(len(edges)):
        for row in range(begin[e], end[e]):
            offsets[row + 1] += 1
    for row in range(rows):
        offsets[row + 1] += offsets[row]
    x, entered = np.zeros(offsets[rows]), np.zeros(offsets[rows], dtype=np.int64)
    filled = offsets[:-1].copy()
    for e in range(len(edges)):
        if begin[e] >= end[e]:
            continue
        a, b = edges[e, 0], edges[e, 1]
        ya, yb = (xy[1, a] - y0) * per_m - 0.5, (xy[1, b] - y0) * per_m - 0.5
        slope = (xy[0, b] - xy[0, a]) / (yb - ya)
        for row in range(begin[e], end[e]):
            at = filled[row]
            x[at] = xy[0, a] + (row - ya) * slope
            entered[at] = more[e] if yb < ya else -more[e]
            filled[row] += 1
    return offsets, x, entered


@numba.njit(cache=True)
def _rows_of(
    y: np.ndarray, edges: np.ndarray, lines: tuple[float, float], rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """First row whose middle each edge crosses and the one after the last, int32, (edge,) each.

    Args:
        y: Heights of the vertices [m], shape (V,).
        edges: Vertices of the edges, shape (edge, 2).
        lines: Lower end of the rows [m] and rows per metre.
        rows: Number of rows.
    """
    y0, per_m = lines
    begin, end = np.zeros(len(edges), dtype=np.int32), np.zeros(len(edges), dtype=np.int32)
    for e in range(len(edges)):
        a, b = (y[edges[e, 0]] - y0) * per_m - 0.5, (y[edges[e, 1]] - y0) * per_m - 0.5
        # An edge that ends at the middle of a row is left to the one that begins there.
        low, high = np.ceil(a if a < b else b), np.ceil(b if a < b else a)
        begin[e] = np.int32(low if low > 0.0 else 0.0)
        end[e] = np.int32(high if high < rows else rows)
    return begin, end


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
    mesh: tuple[np.ndarray, np.ndarray, np.ndarray],
    window: float,
    far: float,
    pitch: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Silhouette as runs.

    Args:
        xy: Plane coordinates [m], no numbers where a vertex does not count, shape (2, V).
        mesh: Triangles, edges and triangles beside the edges, see `ShadowMesh`.
        window: Half width beyond which the silhouette counts as unbounded [m].
        far: Distance beyond which there is no silhouette [m].
        pitch: Largest height of a row, within the limits of their number [m].

    Returns:
        Runs (x from, x to) and the lower and upper y of their rows [m], each shape (N, 2).
    """
    nothing = np.zeros((0, 2))
    x0, x1, y0, y1, distance = _box(xy, window)
    if distance > far or x1 <= x0 or y1 <= y0:
        return nothing, nothing
    rows = min(max(math.ceil((y1 - y0) / pitch), LEAST_ROWS), MOST_ROWS)
    pitch = (y1 - y0) / rows
    contour, more = _contour(xy, mesh)
    offsets, x, entered = _crossings(xy, contour, more, y0, pitch, rows)
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
