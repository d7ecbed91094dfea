# SPDX-License-Identifier: Apache-2.0
"""Where the moving bodies stand, from matched-filter maps and what each device can see.

A body is opaque, so a device pair hears only the side that faces both its ends, and a map's
peak lies in front of the body's centre. Scoring upright cylinders by the side each pair sees
removes that bias, which a plain peak search keeps (0.13–0.23 m at 62 GHz in our tests).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numba
import numpy as np
from jaxtyping import Float, Float64, Int64
from scipy.optimize import linear_sum_assignment
from scipy.spatial import KDTree

from rfgs_core.encode.matched_filter import matched_filter_map
from rfgs_core.measure.delay_maps import delay_power_map
from rfgs_core.measure.observations import Observations
from rfgs_core.model.head import SHARPNESS, dimming
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Radius of the cylinder whose visible side is scored [m]: trunk and arms together.
BODY_RADIUS_M = 0.18
#: Height range of the cylinder [m].
BODY_HEIGHTS_M = (0.15, 1.65)
#: Distance of neighbouring places that are tried [m].
GROUND_STEP_M = 0.04
#: A body is looked for this far around where it is expected [m].
NEAR_M = 0.8
#: The peaks of two bodies are at least this far apart [m].
SEPARATION_M = 0.4
#: A peak's score is the highest this far around it, and its body stands at the mean place [m] …
PEAK_RADIUS_M = 0.2
#: … if weights fall by e for this much of the score: speckle alone moves the highest one.
SCORE_SCALE = 0.1


@dataclass(frozen=True)
class PairMaps:
    """Matched-filter power of each device pair on a regular grid, mean 1 per pair."""

    power: Float[np.ndarray, "pair x y z"]
    """Normalised power."""
    origin_m: Float64[np.ndarray, "3"]
    """Position of the first grid point [m]."""
    spacing_m: float
    """Distance of neighbouring grid points [m]."""
    tx_xyz: Float64[np.ndarray, "pair 3"]
    """Centre of the transmitting elements of each pair [m]."""
    rx_xyz: Float64[np.ndarray, "pair 3"]
    """Centre of the receiving elements of each pair [m]."""

    def at(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "pair N"]:
        """Trilinear reading at `points`; the border value continues outside."""
        return read_grids(self.power, (points - self.origin_m) / self.spacing_m)

    def upright(
        self, places: Float[np.ndarray, "P 2"], heights_m: Float[np.ndarray, "H"]
    ) -> Float[np.ndarray, "pair P"]:
        """Mean of `at` over the heights above each place on the ground."""
        z = np.clip((heights_m - self.origin_m[2]) / self.spacing_m, 0, self.power.shape[3] - 1)
        below = np.minimum(z.astype(int), max(self.power.shape[3] - 2, 0))
        above = np.minimum(below + 1, self.power.shape[3] - 1)
        part = z - below
        # Trilinear reading is linear along z, so the mean over heights can be taken first.
        column = ((1 - part) * self.power[..., below] + part * self.power[..., above]).mean(axis=3)
        index = (places - self.origin_m[:2]) / self.spacing_m
        return read_grids(column[..., None], np.column_stack([index, np.zeros(len(index))]))


def pair_maps(observations: Observations, spacing_m: float | None = None) -> PairMaps:
    """Matched-filter maps over the scene bounds.

    Within one pair the map is as smooth as range resolution and beam width.

    Args:
        observations: The frame.
        spacing_m: Spacing of the grid [m]; None follows the range resolution, between 4 and 12 cm.
    """
    freq_hz = observations.freq_hz
    if spacing_m is None:
        bandwidth_hz = float(freq_hz[-1] - freq_hz[0])
        spacing_m = float(np.clip(0.5 * SPEED_OF_LIGHT / (2 * bandwidth_hz), 0.04, 0.12))
    low, high = observations.bounds_m
    axes = [np.arange(low[k] + spacing_m / 2, high[k], spacing_m) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    pair, names = observations.pairs
    if observations.kind == "delay_power":
        power = delay_power_map(observations, points.reshape(-1, 3))
    else:
        power = matched_filter_map(
            observations.delta, observations.layout, pair, freq_hz, points.reshape(-1, 3)
        )
    power = power.reshape(len(names), *points.shape[:3])
    power /= np.maximum(power.mean(axis=(1, 2, 3), keepdims=True), 1e-30)
    centres = [
        [
            observations.layout.tx_xyz[np.unique(np.nonzero(pair == k)[0])].mean(axis=0),
            observations.layout.rx_xyz[np.unique(np.nonzero(pair == k)[1])].mean(axis=0),
        ]
        for k in range(len(names))
    ]
    tx_xyz, rx_xyz = np.array(centres).transpose(1, 0, 2)
    return PairMaps(power, points[0, 0, 0], spacing_m, tx_xyz, rx_xyz)


def _visible_side_score(
    maps: PairMaps, ground: Float[np.ndarray, "P 2"], floor_m: float
) -> Float64[np.ndarray, "P"]:
    """Mean log power of the side of a cylinder that each pair sees, per ground position."""
    angle = np.arange(16) * np.pi / 8
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    side = (ground[:, None] + BODY_RADIUS_M * normal).reshape(-1, 2)
    power = maps.upright(side, floor_m + np.arange(*BODY_HEIGHTS_M, 0.12))
    score = np.zeros(len(ground))
    for pair, around in enumerate(power.reshape(-1, len(ground), len(angle))):
        seen = np.ones((len(ground), len(angle)))
        for antenna in (maps.tx_xyz[pair], maps.rx_xyz[pair]):
            towards = antenna[:2] - ground
            towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
            seen /= dimming(SHARPNESS * towards @ normal.T)
        level = (seen * around).sum(axis=1) / (seen.sum(axis=1) + 0.2)
        score += np.log(level + 0.05)
    return score / len(power)


def _separate_peaks(
    ground: Float64[np.ndarray, "P 2"], score: Float64[np.ndarray, "P"], count: int
) -> Int64[np.ndarray, "count"]:
    """Rows of the best places that are apart from each other, peaks before slopes.

    The slope of a strong body's peak may be higher than the peak of a weak body.
    """
    tree = KDTree(ground)

    @cache
    def is_peak(place: int) -> bool:
        near = tree.query_ball_point(ground[place], PEAK_RADIUS_M)
        return bool(score[place] >= score[near].max())

    # From the highest down, so that few places are asked whether they are peaks.
    order = np.argsort(-score, kind="stable")
    taken: list[int] = []
    free = np.ones(len(ground), dtype=bool)
    for _ in range(count):
        among = order[free[order]].tolist() or [0]
        # A reach too small for as many peaks still gives as many places.
        taken.append(next(filter(is_peak, among), among[0]))
        distance_m = np.linalg.norm(ground - ground[taken[-1]], axis=1)
        free &= distance_m >= SEPARATION_M
    return np.array(taken)


def _means_around(
    ground: Float64[np.ndarray, "P 2"],
    score: Float64[np.ndarray, "P"],
    peaks: Int64[np.ndarray, "count"],
) -> Float64[np.ndarray, "count 2"]:
    """Mean place around each peak, weighed by score; a place counts for the nearest peak only."""
    distance_m = np.linalg.norm(ground[:, None] - ground[peaks], axis=2)
    nearest = distance_m.argmin(axis=1)
    means = np.zeros((len(peaks), 2))
    for row, peak in enumerate(peaks):
        around = (nearest == row) & (distance_m[:, row] <= PEAK_RADIUS_M)
        weight = np.exp((score[around] - score[peak]) / SCORE_SCALE)
        means[row] = weight @ ground[around] / weight.sum()
    return means


def locate_bodies(
    maps: PairMaps,
    bounds_m: Float64[np.ndarray, "2 3"],
    count: int = 1,
    near: Float[np.ndarray, "count 2"] | None = None,
    reach_m: Float[np.ndarray, "count"] | float = NEAR_M,
) -> Float64[np.ndarray, "count 2"]:
    """Ground positions of upright bodies, at the highest peaks of a map.

    Args:
        maps: Matched-filter maps of the frame.
        bounds_m: Scene bounds [m].
        count: How many bodies there are.
        near: Where each body is expected; None for anywhere.
        reach_m: How far around each of `near` to look [m].

    Returns:
        One position per body [m], in the order of `near` (least sum of squared distances to
        it) or of falling score.
    """
    found = highest_peaks(maps, bounds_m, count, near, reach_m)
    return found if near is None else in_order_of(near, found)


def highest_peaks(
    maps: PairMaps,
    bounds_m: Float64[np.ndarray, "2 3"],
    count: int,
    near: Float[np.ndarray, "body 2"] | None = None,
    reach_m: Float[np.ndarray, "body"] | float = NEAR_M,
) -> Float64[np.ndarray, "count 2"]:
    """Peaks of a map scored for upright bodies, of falling score [m].

    All are found together and then separated: one after the other, the first could take the place
    of the second.

    Args:
        maps: Matched-filter maps of the frame.
        bounds_m: Scene bounds [m].
        count: How many peaks.
        near: Where bodies are expected; None for anywhere.
        reach_m: How far around each of `near` to look [m].
    """
    low, high = standing_room(bounds_m)
    axes = [np.arange(low[k], high[k] + 1e-9, GROUND_STEP_M) for k in range(2)]
    ground = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    if near is not None:
        distance_m = np.linalg.norm(ground[:, None] - near, axis=2)
        # Of a reach that holds no ground, the nearest point of it.
        within = np.maximum(reach_m, distance_m.min(axis=0))
        ground = ground[(distance_m <= within).any(axis=1)]
    score = _visible_side_score(maps, ground, float(bounds_m[0, 2]))
    return _means_around(ground, score, _separate_peaks(ground, score, count))


def standing_room(bounds_m: Float64[np.ndarray, "2 3"]) -> Float64[np.ndarray, "2 2"]:
    """Lowest and highest x and y that leave a body space within the walls [m]."""
    return bounds_m[:, :2] + np.array([[BODY_RADIUS_M], [-BODY_RADIUS_M]])


def in_order_of(
    near: Float[np.ndarray, "body 2"], found: Float64[np.ndarray, "body 2"]
) -> Float64[np.ndarray, "body 2"]:
    """Places in the order of those expected, by the least sum of squared distances."""
    body, place = linear_sum_assignment(np.sum((near[:, None] - found) ** 2, axis=2))
    return found[place[np.argsort(body)]]


def read_grids(
    values: Float[np.ndarray, "grid x y z"], index: Float64[np.ndarray, "N 3"]
) -> Float[np.ndarray, "grid N"]:
    """Trilinear readings of grids of one shape; the border value continues outside.

    Bit for bit those of `scipy.ndimage.map_coordinates(…, order=1, mode="nearest")`, which looks up
    every place anew for each grid and takes ten times as long. Places are told in steps of the grid
    from its first point.
    """
    out = np.zeros((len(values), len(index)), values.dtype)
    _read(np.ascontiguousarray(values), np.ascontiguousarray(index), out)
    return out


@numba.njit(cache=True)
def _read(values: np.ndarray, index: np.ndarray, out: np.ndarray) -> None:
    last_x, last_y, last_z = values.shape[1] - 1, values.shape[2] - 1, values.shape[3] - 1
    for n in range(len(index)):
        x, y, z = index[n]
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        # In this order, for the last bit.
        x_here, y_here, z_here = 1.0 - (x - i), 1.0 - (y - j), 1.0 - (z - k)
        x_next, y_next, z_next = 1.0 - x_here, 1.0 - y_here, 1.0 - z_here
        i_next, j_next = min(max(i + 1, 0), last_x), min(max(j + 1, 0), last_y)
        k_next = min(max(k + 1, 0), last_z)
        i, j, k = min(max(i, 0), last_x), min(max(j, 0), last_y), min(max(k, 0), last_z)
        for grid in range(len(values)):
            v = values[grid]
            total = v[i, j, k] * x_here * y_here * z_here
            total += v[i, j, k_next] * x_here * y_here * z_next
            total += v[i, j_next, k] * x_here * y_next * z_here
            total += v[i, j_next, k_next] * x_here * y_next * z_next
            total += v[i_next, j, k] * x_next * y_here * z_here
            total += v[i_next, j, k_next] * x_next * y_here * z_next
            total += v[i_next, j_next, k] * x_next * y_next * z_here
            total += v[i_next, j_next, k_next] * x_next * y_next * z_next
            out[grid, n] = total
