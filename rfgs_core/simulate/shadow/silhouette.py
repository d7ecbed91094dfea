# SPDX-License-Identifier: Apache-2.0
"""Fresnel integral over the silhouette of a mesh, as seen along one straight segment.

In Fresnel coordinates ν = ρ √(2 s/λ) the Kirchhoff factor of a screen is
T = 1 − (j/2) ∬ e^{−jπν²/2} d²ν. The integrand separates in x and y, so a silhouette that is
cut into rows needs the one-dimensional Fresnel integral at the ends of its runs only.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.special import fresnel

#: Height of the rows that a silhouette is cut into, in Fresnel coordinates; level edges are off
#: by half of it, which is 0.003 of a path past a person.
ROW = 0.02
#: Fewest and most rows.
LEAST_ROWS, MOST_ROWS = 40, 2048
#: Silhouettes wholly beyond this Fresnel coordinate change a path by less than −33 dB.
FAR = 10.0
#: Beyond this coordinate a silhouette counts as unbounded.
WINDOW = 20.0
#: And so it does, relative to how far silhouettes matter at all, on weaker paths.
WINDOW_PER_REACH = WINDOW / FAR
_TABLE_END = 30.0
_TABLE_PER_UNIT = 512
#: Gaps between triangles smaller than this are rounding, not light [m].
_GAP_M = 1e-4


def _fresnel_table() -> np.ndarray:
    """F(ν) = ∫_0^ν e^{−jπt²/2} dt for ν ≥ 0 as rows real, imaginary; the limit at the end."""
    nu = np.arange(int(_TABLE_END * _TABLE_PER_UNIT) + 2) / _TABLE_PER_UNIT
    sine, cosine = fresnel(nu)
    table = np.stack([cosine, -sine])
    table[:, -2:] = [[0.5], [-0.5]]
    return table


FRESNEL = _fresnel_table()


@numba.njit(cache=True, fastmath={"contract", "nsz"})
def _add_fresnel(
    table: np.ndarray,
    edge: float,
    shift: np.ndarray,
    per_m: np.ndarray,
    sign: float,
    out: np.ndarray,
) -> None:
    """Adds sign · F((edge − shift) · per_m) for many shifts; `out` holds real and imaginary."""
    last = table.shape[1] - 2
    for e in range(len(shift)):
        nu = (edge - shift[e]) * per_m[e]
        place = min(abs(nu) * _TABLE_PER_UNIT, last - 0.0)
        i = np.int32(place)
        share = place - i
        signed = math.copysign(sign, nu) if sign > 0.0 else -math.copysign(sign, nu)
        out[0, e] += signed * (table[0, i] + (table[0, i + 1] - table[0, i]) * share)
        out[1, e] += signed * (table[1, i] + (table[1, i + 1] - table[1, i]) * share)


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
def _crossing(xy: np.ndarray, face: np.ndarray, y: float) -> tuple[float, float]:
    """Where the line at height y enters and leaves a triangle; an empty span outside."""
    low, high = math.inf, -math.inf
    for e in range(3):
        a, b = face[e], face[(e + 1) % 3]
        ya, yb = xy[a, 1], xy[b, 1]
        if (ya <= y) != (yb <= y):
            x = xy[a, 0] + (y - ya) / (yb - ya) * (xy[b, 0] - xy[a, 0])
            low, high = min(low, x), max(high, x)
    return low, high


@numba.njit(cache=True)
def _spans(
    xy: np.ndarray, between: np.ndarray, faces: np.ndarray, y0: float, pitch: float, rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """Spans of every triangle in every row, grouped by row: offsets (rows + 1) and (N, 2)."""
    counts = np.zeros(rows + 1, dtype=np.int64)
    first = np.zeros(len(faces), dtype=np.int64)
    last = np.full(len(faces), -1, dtype=np.int64)
    for t in range(len(faces)):
        a, b, c = faces[t]
        if not (between[a] and between[b] and between[c]):
            continue
        low = min(xy[a, 1], xy[b, 1], xy[c, 1])
        high = max(xy[a, 1], xy[b, 1], xy[c, 1])
        first[t] = max(math.ceil((low - y0) / pitch - 0.5), 0)
        last[t] = min(math.floor((high - y0) / pitch - 0.5), rows - 1)
        for row in range(first[t], last[t] + 1):
            counts[row + 1] += 1
    for row in range(rows):
        counts[row + 1] += counts[row]
    spans = np.zeros((counts[rows], 2))
    filled = counts[:-1].copy()
    for t in range(len(faces)):
        for row in range(first[t], last[t] + 1):
            low, high = _crossing(xy, faces[t], y0 + (row + 0.5) * pitch)
            spans[filled[row], 0], spans[filled[row], 1] = low, high
            filled[row] += 1
    return counts, spans


@numba.njit(cache=True)
def _joined(runs: np.ndarray, at: int, count: int) -> int:
    """Joins a run that has grown with those after it that it now meets; returns how many remain."""
    last = at + 1
    while last < count and runs[last, 0] <= runs[at, 1] + _GAP_M:
        runs[at, 1] = max(runs[at, 1], runs[last, 1])
        last += 1
    gone = last - at - 1
    if gone:
        for i in range(last, count):
            runs[i - gone, 0], runs[i - gone, 1] = runs[i, 0], runs[i, 1]
    return count - gone


@numba.njit(cache=True)
def _merged(spans: np.ndarray, window: float, runs: np.ndarray) -> int:
    """Fills in the union of one row's spans as disjoint runs, clipped ends pushed to infinity.

    Neighbouring triangles follow each other, so that most spans meet the run of the one before:
    that is faster than sorting them.

    Args:
        spans: From and to, shape (span, 2).
        window: Half width beyond which the silhouette counts as unbounded [m].
        runs: Filled, ascending, shape (span, 2) or longer.

    Returns:
        Number of runs.
    """
    count, at = 0, 0
    for s in range(len(spans)):
        low, high = spans[s, 0], spans[s, 1]
        if low > high:
            continue
        at = min(at, count)
        while at > 0 and runs[at - 1, 1] + _GAP_M >= low:
            at -= 1
        while at < count and runs[at, 1] + _GAP_M < low:
            at += 1
        if at == count or runs[at, 0] > high + _GAP_M:
            for i in range(count, at, -1):
                runs[i, 0], runs[i, 1] = runs[i - 1, 0], runs[i - 1, 1]
            runs[at, 0], runs[at, 1] = low, high
            count += 1
            continue
        runs[at, 0], runs[at, 1] = min(runs[at, 0], low), max(runs[at, 1], high)
        count = _joined(runs, at, count)
    for i in range(count):
        if runs[i, 0] <= -window:
            runs[i, 0] = -math.inf
        if runs[i, 1] >= window:
            runs[i, 1] = math.inf
    return count


@numba.njit(cache=True)
def runs_of(
    xy: np.ndarray,
    between: np.ndarray,
    faces: np.ndarray,
    window: float,
    far: float,
    pitch: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Silhouette as runs.

    Args:
        xy: Plane coordinates [m], shape (V, 2).
        between: Which vertices count, shape (V,).
        faces: Triangles, shape (T, 3).
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
    offsets, spans = _spans(xy, between, faces, y0, pitch, rows)
    runs, heights = np.zeros_like(spans), np.zeros_like(spans)
    count = 0
    for row in range(rows):
        end = count + _merged(spans[offsets[row] : offsets[row + 1]], window, runs[count:])
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
def _add_boundary(
    table: np.ndarray,
    edge: float,
    shift: np.ndarray,
    per_m: np.ndarray,
    below: np.ndarray,
    above: np.ndarray,
    at: np.ndarray,
    total: np.ndarray,
) -> None:
    """Adds F at the boundary of two rows times what the lower one has more; `at` is scratch."""
    at[:] = 0.0
    _add_fresnel(table, edge, shift, per_m, 1.0, at)
    for e in range(len(total)):
        re, im = below[0, e] - above[0, e], below[1, e] - above[1, e]
        total[e] += complex(at[0, e] * re - at[1, e] * im, at[0, e] * im + at[1, e] * re)


@numba.njit(cache=True)
def screen_factors(
    table: np.ndarray, runs: np.ndarray, heights: np.ndarray, shifts: np.ndarray, per_m: np.ndarray
) -> np.ndarray:
    """Kirchhoff factors T of a silhouette for lines through its plane, each at its frequency.

    Args:
        table: `FRESNEL`.
        runs: Runs of the silhouette [m], shape (N, 2).
        heights: Rows of the runs [m], shape (N, 2).
        shifts: Where each line crosses the plane [m], rows x and y, shape (2, line).
        per_m: Fresnel coordinate per metre for each line, √(2 s/λ), shape (line,).

    Returns:
        Factors on the amplitudes, complex128, shape (line,); 1 without a silhouette.
    """
    # The integral over y of each row is a difference of two values, so that each boundary
    # between rows takes one value, times how the rows differ.
    total = np.zeros(shifts.shape[1], dtype=np.complex128)
    shape = (2, shifts.shape[1])
    across, before, at = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for i in range(len(runs) + 1):
        first = i == 0 or i == len(runs) or heights[i, 0] != heights[i - 1, 0]
        if first and i > 0:
            _add_boundary(table, heights[i - 1, 0], shifts[1], per_m, before, across, at, total)
            before, across = across, before
            across[:] = 0.0
            if i == len(runs) or heights[i, 0] != heights[i - 1, 1]:
                _add_boundary(table, heights[i - 1, 1], shifts[1], per_m, before, across, at, total)
                before[:] = 0.0
        if i < len(runs):
            _add_fresnel(table, runs[i, 1], shifts[0], per_m, 1.0, across)
            _add_fresnel(table, runs[i, 0], shifts[0], per_m, -1.0, across)
    return 1.0 - 0.5j * total


@numba.njit(cache=True)
def farthest(runs: np.ndarray, heights: np.ndarray, shifts: np.ndarray) -> float:
    """Distance of the farthest corner within bounds from any of the lines' crossings [m].

    Args:
        runs: As `runs_of` gives them.
        heights: Likewise.
        shifts: As `screen_factors` takes them.
    """
    most = 0.0
    ways = np.abs(shifts[0]).max(), np.abs(shifts[1]).max()
    for i in range(len(runs)):
        for x in runs[i]:
            for y in heights[i]:
                across = abs(x) + ways[0] if math.isfinite(x) else 0.0
                along = abs(y) + ways[1] if math.isfinite(y) else 0.0
                most = max(most, math.sqrt(across * across + along * along))
    return most


@numba.njit(cache=True)
def covers(runs: np.ndarray, heights: np.ndarray) -> bool:
    """Whether the path itself, at the origin of the plane, is hidden."""
    for i in range(len(runs)):
        if heights[i, 0] <= 0.0 < heights[i, 1] and runs[i, 0] <= 0.0 < runs[i, 1]:
            return True
    return False
