# SPDX-License-Identifier: Apache-2.0
"""From Gaussians to ellipses in a picture (formulas in `splat.py`), and gradients back.

Each principal axis of a Gaussian is a small arrow, u_k across and v_k down in the picture, so that
the covariance is Σ_k (u_k, v_k)(u_k, v_k)ᵀ + 0.3 I, and the way back goes through the arrows.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from rfgs_core.render.cameras import Camera
from rfgs_core.render.hidden import REACH_MARGIN
from rfgs_core.render.splat import ALPHA_MIN, DILATION_PX2, NEAR_M, SLOPE_MARGIN


def eye_of(camera: Camera) -> np.ndarray:
    """Focal lengths and optical axis [px], shape (4,)."""
    return np.array([camera.fl_x, camera.fl_y, camera.cx, camera.cy])


@numba.njit(cache=True, inline="always")
def _along(view: np.ndarray, row: int, vector: tuple[float, float, float]) -> float:
    """One view axis of a vector of the world."""
    return view[row, 0] * vector[0] + view[row, 1] * vector[1] + view[row, 2] * vector[2]


@numba.njit(cache=True, inline="always")
def _axes(w: float, x: float, y: float, z: float) -> tuple[Any, Any, Any]:
    """Columns of the rotation of a quaternion of any length."""
    k = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1 - k * (y * y + z * z), k * (x * y + w * z), k * (x * z - w * y)),
        (k * (x * y - w * z), 1 - k * (x * x + z * z), k * (y * z + w * x)),
        (k * (x * z + w * y), k * (y * z - w * x), 1 - k * (x * x + y * y)),
    )


@numba.njit(cache=True, inline="always")
def _slopes(
    place: tuple[float, float, float], eye: np.ndarray, size: tuple[int, int]
) -> tuple[float, float]:
    """Slopes of the line of sight, clamped to the picture and a margin."""
    beyond_x, beyond_y = SLOPE_MARGIN * size[0], SLOPE_MARGIN * size[1]
    slope_x = max(place[0] / place[2], -(eye[2] + beyond_x) / eye[0])
    slope_y = max(place[1] / place[2], -(eye[3] + beyond_y) / eye[1])
    return (
        min(slope_x, (size[0] - eye[2] + beyond_x) / eye[0]),
        min(slope_y, (size[1] - eye[3] + beyond_y) / eye[1]),
    )


@numba.njit(cache=True, inline="always")
def _arrow(
    axis: tuple[float, float, float],
    size_m: float,
    depth: float,
    slopes: tuple[float, float],
    view: np.ndarray,
    eye: np.ndarray,
) -> tuple[float, float]:
    """J applied to a principal axis of standard deviation size_m: across and down [px]."""
    forward = _along(view, 2, axis)
    across = eye[0] / depth * size_m * (_along(view, 0, axis) - slopes[0] * forward)
    return across, eye[1] / depth * size_m * (_along(view, 1, axis) - slopes[1] * forward)


@numba.njit(cache=True, inline="always")
def _covariance(
    axes: tuple[Any, Any, Any],
    sizes_m: tuple[float, float, float],
    depth: float,
    slopes: tuple[float, float],
    view: np.ndarray,
    eye: np.ndarray,
) -> tuple[float, float, float]:
    """Dilated covariance in the picture, (xx, xy, yy) [px²]."""
    xx, xy, yy = DILATION_PX2, 0.0, DILATION_PX2
    for axis, size_m in zip(axes, sizes_m):  # noqa: B905  numba knows no `strict`
        across, down = _arrow(axis, size_m, depth, slopes, view, eye)
        xx, xy, yy = xx + across * across, xy + across * down, yy + down * down
    return xx, xy, yy


@numba.njit(cache=True, inline="always")
def _place(means: np.ndarray, row: int, view: np.ndarray) -> tuple[float, float, float]:
    """Centre of a Gaussian along the view axes [m]."""
    mean = float(means[row, 0]), float(means[row, 1]), float(means[row, 2])
    across, down = _along(view, 0, mean) + view[0, 3], _along(view, 1, mean) + view[1, 3]
    return across, down, _along(view, 2, mean) + view[2, 3]


@numba.njit(cache=True, inline="always")
def _principal(quats: np.ndarray, row: int) -> tuple[Any, Any, Any]:
    """Principal axes of a Gaussian."""
    w, x = float(quats[row, 0]), float(quats[row, 1])
    return _axes(w, x, float(quats[row, 2]), float(quats[row, 3]))


@numba.njit(cache=True, inline="always")
def _sizes(log_scales: np.ndarray, row: int) -> tuple[float, float, float]:
    """Standard deviations of a Gaussian along its axes [m]."""
    first, second = np.exp(float(log_scales[row, 0])), np.exp(float(log_scales[row, 1]))
    return first, second, np.exp(float(log_scales[row, 2]))


@numba.njit(cache=True, inline="always")
def _pixels(middle: float, variance: float, reach: float, size: int) -> tuple[int, int]:
    """First and one-past-last pixel whose centre a splat may reach."""
    half = np.sqrt(2.0 * reach * variance)
    half += REACH_MARGIN * (1.0 + half)
    first = min(max(np.ceil(middle - half - 0.5), 0.0), float(size))
    last = min(max(np.floor(middle + half - 0.5) + 1.0, 0.0), float(size))
    return int(first), int(last)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def project(
    means: np.ndarray,  # [M, 3]
    quats: np.ndarray,  # [M, 4]
    log_scales: np.ndarray,  # [M, 3]
    logits: np.ndarray,  # [M]
    view: np.ndarray,  # [4, 4], view axes from the world
    eye: np.ndarray,  # focal lengths and optical axis [px]
    size: tuple[int, int],  # columns and rows of the picture
    splats: np.ndarray,  # [M, 7], written where seen
    depths: np.ndarray,  # [M]
    bounds: np.ndarray,  # [M, 4], first and one-past-last column and row that may be reached
    seen: np.ndarray,  # [M]
) -> None:
    """Ellipses and depths of the Gaussians that may reach a pixel; all but `seen` stay as they are.

    Columns of `splats` are those of `TiledSplats.splats`.
    """
    for row in numba.prange(len(means)):
        place = _place(means, row, view)
        depth, opacity = place[2], 1.0 / (1.0 + np.exp(-float(logits[row])))
        if not (depth > NEAR_M and opacity >= ALPHA_MIN):
            continue
        axes, sizes_m = _principal(quats, row), _sizes(log_scales, row)
        xx, xy, yy = _covariance(axes, sizes_m, depth, _slopes(place, eye, size), view, eye)
        reach = np.log(opacity / ALPHA_MIN)
        column, line = eye[0] * place[0] / depth + eye[2], eye[1] * place[1] / depth + eye[3]
        determinant = xx * yy - xy * xy
        # Numbers that are none hold in no comparison; they would name tiles that are not there.
        if not (determinant > 0.0 and np.isfinite(determinant) and np.isfinite(column + line)):
            continue
        bounds[row, 0], bounds[row, 1] = _pixels(column, xx, reach, size[0])
        bounds[row, 2], bounds[row, 3] = _pixels(line, yy, reach, size[1])
        seen[row] = bounds[row, 0] < bounds[row, 1] and bounds[row, 2] < bounds[row, 3]
        splats[row, 0], splats[row, 1], splats[row, 2] = column, line, yy / determinant
        splats[row, 3], splats[row, 4] = -xy / determinant, xx / determinant
        splats[row, 5], splats[row, 6], depths[row] = opacity, reach, depth


@numba.njit(cache=True, parallel=True, error_model="numpy")
def project_back(
    means: np.ndarray,  # [M, 3]
    quats: np.ndarray,  # [M, 4]
    log_scales: np.ndarray,  # [M, 3]
    view: np.ndarray,  # [4, 4]
    eye: np.ndarray,  # [4]
    size: tuple[int, int],
    rows: np.ndarray,  # [S], the Gaussians that are seen
    splats: np.ndarray,  # [S, 7], as `project` wrote them
    towards: np.ndarray,  # [S, 6], gradient of the first six
    towards_depth: np.ndarray,  # [S]
    to_means: np.ndarray,  # [M, 3], zero on entry like those below
    to_quats: np.ndarray,  # [M, 4]
    to_log_scales: np.ndarray,  # [M, 3]
    to_logits: np.ndarray,  # [M]
) -> None:
    """Gradients of means, quaternions, log-scales and logits of the Gaussians that are seen."""
    for s in numba.prange(len(rows)):
        row, opacity = rows[s], splats[s, 5]
        to_logits[row] = towards[s, 5] * opacity * (1.0 - opacity)
        place = _place(means, row, view)
        depth, slopes = place[2], _slopes(place, eye, size)
        per_x, per_y = eye[0] / depth, eye[1] / depth
        axes, sizes_m = _principal(quats, row), _sizes(log_scales, row)
        xx, xy, yy = _covariance_slopes(splats[s], towards[s])
        to_place = np.zeros(3)
        to_place[0], to_place[1] = towards[s, 0] * per_x, towards[s, 1] * per_y
        to_place[2] = towards_depth[s] - (to_place[0] * place[0] + to_place[1] * place[1]) / depth
        to_slope_x, to_slope_y, to_axes, k = 0.0, 0.0, np.zeros((3, 3)), 0
        for axis, size_m in zip(axes, sizes_m):  # noqa: B905
            across, down = _arrow(axis, size_m, depth, slopes, view, eye)
            to_across, to_down = 2.0 * xx * across + xy * down, xy * across + 2.0 * yy * down
            to_log_scales[row, k] = to_across * across + to_down * down
            to_place[2] -= to_log_scales[row, k] / depth
            by_x, by_y = per_x * size_m * to_across, per_y * size_m * to_down
            forward = _along(view, 2, axis)
            to_slope_x, to_slope_y = to_slope_x - by_x * forward, to_slope_y - by_y * forward
            for i in range(3):
                to_axes[k, i] = by_x * (view[0, i] - slopes[0] * view[2, i])
                to_axes[k, i] += by_y * (view[1, i] - slopes[1] * view[2, i])
            k += 1
        # A slope at the margin does not move with its Gaussian.
        for axis, slope, to_slope in ((0, slopes[0], to_slope_x), (1, slopes[1], to_slope_y)):
            if slope == place[axis] / depth:
                to_place[axis] += to_slope / depth
                to_place[2] -= to_slope * slope / depth
        for i in range(3):
            for axis in range(3):
                to_means[row, i] += to_place[axis] * view[axis, i]
        _quaternion_back(to_quats[row], quats[row], to_axes)


@numba.njit(cache=True, inline="always")
def _covariance_slopes(splat: np.ndarray, towards: np.ndarray) -> tuple[float, float, float]:
    """From the gradient of an inverse covariance to that of (xx, xy, yy): −Σ⁻¹ G Σ⁻¹."""
    a, b, c = splat[2], splat[3], splat[4]
    to_a, half_b, to_c = towards[2], 0.5 * towards[3], towards[4]
    left_x, left_y = a * to_a + b * half_b, a * half_b + b * to_c
    right_x, right_y = b * to_a + c * half_b, b * half_b + c * to_c
    xy = -2.0 * (left_x * b + left_y * c)
    return -(left_x * a + left_y * b), xy, -(right_x * b + right_y * c)


@numba.njit(cache=True, inline="always")
def _quaternion_back(out: np.ndarray, quat: np.ndarray, towards: np.ndarray) -> None:
    """From the gradient of the columns of a rotation, [3, 3], to that of its quaternion.

    R = I + k P(q) with k = 2 / |q|², and P quadratic: P · G = q · (dP/dq · G) / 2.
    """
    w, x, y, z = float(quat[0]), float(quat[1]), float(quat[2]), float(quat[3])
    (g00, g01, g02), (g10, g11, g12), (g20, g21, g22) = (
        (towards[0, 0], towards[0, 1], towards[0, 2]),
        (towards[1, 0], towards[1, 1], towards[1, 2]),
        (towards[2, 0], towards[2, 1], towards[2, 2]),
    )
    to_w = z * (g01 - g10) + y * (g20 - g02) + x * (g12 - g21)
    to_x = y * (g01 + g10) + z * (g02 + g20) + w * (g12 - g21) - 2.0 * x * (g11 + g22)
    to_y = x * (g01 + g10) + z * (g12 + g21) + w * (g20 - g02) - 2.0 * y * (g00 + g22)
    to_z = x * (g02 + g20) + y * (g12 + g21) + w * (g01 - g10) - 2.0 * z * (g00 + g11)
    k = 2.0 / (w * w + x * x + y * y + z * z)
    along = 0.5 * k * k * (w * to_w + x * to_x + y * to_y + z * to_z)
    out[0], out[1] = k * to_w - along * w, k * to_x - along * x
    out[2], out[3] = k * to_y - along * y, k * to_z - along * z
