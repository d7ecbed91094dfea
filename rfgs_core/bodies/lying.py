# SPDX-License-Identifier: Apache-2.0
"""Who lies, and where: level bars that maps show below where somebody upright would be loud.

Bodies are sought as upright columns, and a column fits somebody who lies at one of their ends. So
level bars are tried around it; if the best of them is louder than anything at the height of a
chest, the likelihood of `posture` tells whether somebody lies there, rather than stands or sits
where they were found.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from rfgs_core.bodies.body_prior import LYING_LEGS_M, LYING_TRUNK_M, Bodies
from rfgs_core.bodies.localise import SEPARATION_M, PairMaps, pair_maps
from rfgs_core.bodies.posture import DIRECTIONS, PostureEvidence
from rfgs_core.bodies.separation import each_alone
from rfgs_core.bodies.start import StartCells
from rfgs_core.measure.observations import Observations
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import in_threads

#: Heights of the middle of who lies on the floor and on a bed [m].
HEIGHTS_M = (0.13, 0.6)
#: A bar is looked for this far around where a column was found [m].
REACH_M = 1.2
#: Ways of bars that are tried, half a turn apart at most, and distance of their places [m].
WAYS, STEP_M = 8, 0.08
#: Places along a bar at which maps are read, and heights around its own [m].
_ALONG_M, _AROUND_M = np.linspace(-0.7, 0.7, 12), np.array([-0.03, 0.07, 0.17])
#: Heights at which somebody upright, seated or not, is louder than who lies [m].
_CHEST_M = np.array([0.9, 1.1, 1.3])
#: A bar that is quieter than that by this logarithm of power is not asked for.
CHEST_LOG = 0.1
#: Bars whose likelihood is asked for at each height, with the head at either end: the loudest that
#: differ by a place or a turn.
BARS, APART_M, APART_RAD = 3, 0.3, 0.5
#: Steps along and across a bar [m] and turns [rad] by which the likeliest one is improved, in turn.
NUDGES = (*2 * ((0.2, 0.15, np.pi / WAYS),), (0.1, 0.08, 0.5 * np.pi / WAYS))
#: Evidence that it takes to call somebody lying [nat].
TO_LIE = 30.0


def with_lying(
    observations: Observations,
    maps: PairMaps,
    axes_xy: Float64[np.ndarray, "body 2"],
    config: TrainConfig,
    seed: int,
    before: Bodies | None = None,
) -> Bodies:
    """Bodies that stand, but for those who lie, who are moved to where they do.

    Args:
        observations: The frame; without phases all are taken to stand.
        maps: Its matched-filter maps.
        axes_xy: Where columns were found [m].
        config: How echoes are told apart, and whether postures are told at all.
        seed: Seed of the Gaussians that stand for bodies.
        before: The bodies in the frame before: who lay there may lie on.
    """
    standing = Bodies.standing(axes_xy)
    if config.posture == "standing" or observations.kind != "complex":
        return standing
    low = [may_lie(maps, observations.bounds_m, axes_xy, body) for body in range(len(axes_xy))]
    if not any(low):
        return standing
    found = standing
    for body, alone in enumerate(each_alone(observations, maps, axes_xy, config, seed)):
        if low[body]:
            own_maps = maps if alone is observations else pair_maps(alone)
            lay = [before.only(body)] if before is not None and before.lies[body] else []
            here = _lies(alone, own_maps, axes_xy, body, lay, sub_seed(seed, "lying", body))
            if here is not None:
                found = _put(found, body, here)
    return found


def _put(bodies: Bodies, body: int, here: Bodies) -> Bodies:
    """Bodies with one of them as another has it."""
    axes_xy, lying = bodies.axes_xy.copy(), bodies.ways.copy()
    axes_xy[body], lying[body] = here.axes_xy[0], here.ways[0]
    return Bodies(axes_xy, bodies.knees_rad, lying)


def may_lie(
    maps: PairMaps,
    bounds_m: Float64[np.ndarray, "2 3"],
    axes_xy: Float64[np.ndarray, "body 2"],
    body: int,
) -> bool:
    """Whether a level bar around a body is about as loud as anything at the height of a chest."""
    ground = _ground(bounds_m, axes_xy, body)
    chest = np.log(maps.upright(ground, bounds_m[0, 2] + _CHEST_M) + 0.05).mean(axis=0).max()
    loudest = max(_loudness(maps, bounds_m, ground, height).max() for height in HEIGHTS_M)
    return bool(loudest > chest - CHEST_LOG)


def bars_around(
    maps: PairMaps,
    bounds_m: Float64[np.ndarray, "2 3"],
    axes_xy: Float64[np.ndarray, "body 2"],
    body: int,
) -> list[Bodies]:
    """The loudest level bars around one of some bodies, of every height, as bodies that lie."""
    ground = _ground(bounds_m, axes_xy, body)
    found = []
    for height_m in HEIGHTS_M:
        loud = _loudness(maps, bounds_m, ground, height_m)
        found += _loudest(loud, ground, height_m)
    return found


def _ground(
    bounds_m: Float64[np.ndarray, "2 3"], axes_xy: Float64[np.ndarray, "body 2"], body: int
) -> Float64[np.ndarray, "P 2"]:
    """Places around one body that are not nearer to another."""
    low = np.maximum(bounds_m[0, :2] + 0.5 * STEP_M, axes_xy[body] - REACH_M)
    high = np.minimum(bounds_m[1, :2], axes_xy[body] + REACH_M)
    axes = [np.arange(low[k], high[k] + 1e-9, STEP_M) for k in range(2)]
    ground = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    away = np.linalg.norm(ground[:, None] - axes_xy, axis=2)
    return ground[(away[:, [body]] <= away + SEPARATION_M).all(axis=1)]


def _loudness(
    maps: PairMaps,
    bounds_m: Float64[np.ndarray, "2 3"],
    ground: Float64[np.ndarray, "P 2"],
    height_m: float,
) -> Float64[np.ndarray, "way P"]:
    """Mean log power along bars of all ways at some places; −∞ where they reach outside."""
    levels = bounds_m[0, 2] + height_m + _AROUND_M
    loud = np.full((WAYS, len(ground)), -np.inf)
    for k, way in enumerate(np.arange(WAYS) * np.pi / WAYS):
        places = ground[:, None] + _ALONG_M[:, None] * _ahead(way)
        inside = ((places >= bounds_m[0, :2]) & (places <= bounds_m[1, :2])).all(axis=(1, 2))
        power = maps.upright(places[inside].reshape(-1, 2), levels)
        log = np.log(power + 0.05).reshape(len(power), -1, len(_ALONG_M))
        loud[k, inside] = log.mean(axis=(0, 2))
    return loud


def _loudest(
    loud: Float64[np.ndarray, "way P"], ground: Float64[np.ndarray, "P 2"], height_m: float
) -> list[Bodies]:
    """Bodies on the loudest bars that differ by a place or a turn, the head at either end."""
    found: list[tuple[np.ndarray, float]] = []
    for index in np.argsort(-loud, axis=None):
        k, place = np.unravel_index(index, loud.shape)
        if len(found) == BARS or not np.isfinite(loud[k, place]):
            break
        spot, way = ground[place], float(k) * np.pi / WAYS
        if all(
            np.linalg.norm(spot - other) > APART_M or abs(_turn(way - angle)) > APART_RAD
            for other, angle in found
        ):
            found.append((spot, way))
    # The hips are not quite in the middle.
    return [
        _lying(spot - 0.5 * (LYING_TRUNK_M - LYING_LEGS_M) * _ahead(angle), angle, height_m)
        for spot, way in found
        for angle in (way, way + np.pi)
    ]


def _ahead(way_rad: float) -> Float64[np.ndarray, "2"]:
    return np.array([np.cos(way_rad), np.sin(way_rad)])


def _turn(angle: float) -> float:
    """The least turn from one line to another [rad]."""
    return (angle + 0.5 * np.pi) % np.pi - 0.5 * np.pi


def _lying(spot: np.ndarray, way_rad: float, height_m: float) -> Bodies:
    return Bodies(
        np.asarray(spot, dtype=np.float64)[None],
        np.array([np.nan]),
        np.array([[way_rad % (2 * np.pi), height_m]]),
    )


def _lies(
    observations: Observations,
    maps: PairMaps,
    axes_xy: Float64[np.ndarray, "body 2"],
    body: int,
    lay: list[Bodies],
    seed: int,
) -> Bodies | None:
    """Where one body lies, tried where it lay before as well; None if it does not."""
    bounds_m, ground = observations.bounds_m, _ground(observations.bounds_m, axes_xy, body)
    evidence = PostureEvidence.of(observations, seed)
    # Turned end for end, by a little, or with knees to any side, a body fills the same cells.
    cells: dict[tuple[float, float, bool], StartCells] = {}

    def likely(bodies: Bodies) -> Float64[np.ndarray, "pair"]:
        where = (*bodies.axes_xy[0].tolist(), bool(bodies.lies[0]))
        if where not in cells:
            cells[where] = StartCells.of(maps, bodies, bounds_m)
        return evidence.of_density(cells[where].density(bodies), bodies)

    def climbed(
        start: tuple[Bodies, np.ndarray], tries: list[Bodies]
    ) -> tuple[Bodies, Float64[np.ndarray, "pair"]]:
        """The likeliest of a body as it is and in other places."""
        inside = [one for one in tries if _inside(one, bounds_m)]
        for one in zip(inside, in_threads(likely, inside), strict=True):
            if evidence.lead(one[1], start[1]) > 0.0:
                start = one
        return start

    bars = [
        _loudest(_loudness(maps, bounds_m, ground, height), ground, height) for height in HEIGHTS_M
    ]
    upright = Bodies.standing(axes_xy[[body]])
    standing = likely(upright)
    # Of most bodies that stand the loudest bars are enough to see that.
    best = climbed((upright, standing), [*lay, *(bar for found in bars for bar in found[:2])])
    if best[0] is upright:
        return None
    best = climbed(best, [bar for found in bars for bar in found[2:]])
    for nudge in NUDGES:
        best = climbed(best, _nudged(best[0], nudge))
    angles = np.arange(DIRECTIONS) * (2 * np.pi / DIRECTIONS)
    seated = [Bodies(upright.axes_xy, np.array([angle])) for angle in angles]
    rivals = [standing, *in_threads(likely, seated)]
    return best[0] if min(evidence.lead(best[1], rival) for rival in rivals) > TO_LIE else None


def _nudged(bodies: Bodies, nudge: tuple[float, float, float]) -> list[Bodies]:
    """A lying body moved along or across itself, or turned a little or end for end."""
    along_m, across_m, turn_rad = nudge
    way_rad, height_m = bodies.ways[0]
    ahead = _ahead(way_rad)
    aside = np.array([-ahead[1], ahead[0]])
    steps = [side * step for step in (along_m * ahead, across_m * aside) for side in (-1.0, 1.0)]
    moved = [_lying(bodies.axes_xy[0] + step, way_rad, height_m) for step in steps]
    turns = (-turn_rad, turn_rad, np.pi)
    return moved + [_lying(bodies.axes_xy[0], way_rad + turn, height_m) for turn in turns]


def _inside(bodies: Bodies, bounds_m: Float64[np.ndarray, "2 3"]) -> bool:
    """Whether the middle of a body is within the scene."""
    spot = bodies.axes_xy[0]
    return bool(((spot >= bounds_m[0, :2]) & (spot <= bounds_m[1, :2])).all())
