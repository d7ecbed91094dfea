# SPDX-License-Identifier: Apache-2.0
"""Which paths a body is near enough to for its shadow to matter."""

from __future__ import annotations

import numba
import numpy as np

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.unfold import unfold

#: Silhouettes wholly beyond this Fresnel coordinate change a path by less than −33 dB.
FAR = 10.0
#: Shadows that change a device pair by less than this share of its strongest path are left out.
NEGLIGIBLE = 1e-3


def relative_amplitude(paths: PathSet) -> np.ndarray:
    """Amplitude of each path relative to the strongest of its pair of sites, shape (path,)."""
    strength = np.abs(paths.amplitude).max(axis=(1, 2))
    pair = paths.tx * (int(paths.rx.max(initial=0)) + 1) + paths.rx
    strongest = np.zeros(int(pair.max(initial=0)) + 1)
    np.maximum.at(strongest, pair, strength)
    return strength / np.maximum(strongest[pair], 1e-300)


@numba.njit(cache=True)
def reach(relative: float) -> float:
    """Fresnel coordinate up to which a shadow on a path of some relative amplitude matters.

    At ν from its edge a screen changes a path by about 1/(√2 π ν) of its amplitude.
    """
    return min(relative / (np.sqrt(2.0) * np.pi * NEGLIGIBLE), FAR)


def near_segments(paths: PathSet, vertices: np.ndarray, highest_hz: float) -> np.ndarray:
    """Which segments of paths a body may shade, walls or not, bool, shape (path, segment).

    Args:
        paths: Environment paths.
        vertices: Vertices of the body [m], shape (V, 3).
        highest_hz: Highest frequency [Hz].
    """
    before, after, _, _ = unfold(paths)
    ball = _ball(vertices)
    return _near(paths.vertices, before, after, relative_amplitude(paths), *ball, highest_hz)


def _ball(vertices: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius of a ball around a body [m]."""
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)).astype(np.float64)
    return centre, float(np.linalg.norm(vertices - centre, axis=1).max())


@numba.njit(cache=True)
def _near(
    corners: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    relative: np.ndarray,
    centre: np.ndarray,
    radius: float,
    freq_hz: float,
) -> np.ndarray:
    """Which segments a ball may come nearer to than the reach, bool, shape (path, segment).

    Fresnel coordinates grow towards the ends of the unfolded line: what counts is their scale
    where the ball is nearest to its middle.
    """
    near = np.zeros(before.shape, dtype=np.bool_)
    for p in range(near.shape[0]):
        for i in range(near.shape[1]):
            way = corners[p, i + 1] - corners[p, i]
            to = centre - corners[p, i]
            length = np.sqrt((way * way).sum())
            if length < 1e-6:
                continue
            depth = (to * way).sum() / length
            low, high = max(depth - radius, 0.0), min(depth + radius, length)
            if low >= high:
                continue
            clearance_m = np.sqrt(max((to * to).sum() - depth * depth, 0.0)) - radius
            whole = before[p, i] + length + after[p, i]
            at = min(max(0.5 * whole, before[p, i] + low), before[p, i] + high)
            per_m = np.sqrt(2.0 * (1.0 / at + 1.0 / (whole - at)) * freq_hz / SPEED_OF_LIGHT)
            near[p, i] = clearance_m * per_m <= reach(relative[p])
    return near
