# SPDX-License-Identifier: Apache-2.0
"""Where people are likeliest, each with what the walls send back of them.

A map's peak is drawn aside by echoes off walls, the more so the fewer antennas tell directions, and
its highest peak may be such an echo. Here a place is as likely as what a standing body there
explains of the channel, straight and by way of one wall, of levels that are fitted for each device
pair (see `limbs.evidence.levels`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Complex64, Float, Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.expected_echoes import ExpectedEchoes, middle_of
from rfgs_core.bodies.gain import FEWEST_PAIRS as FEWEST_TO_CHOOSE
from rfgs_core.bodies.gain import in_room, stands_clear
from rfgs_core.bodies.localise import NEAR_M, SEPARATION_M, PairMaps, highest_peaks
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.levels import Levels
from rfgs_core.measure.observations import Observations
from rfgs_core.threads import in_threads

#: Of fewer device pairs that hear anything, whether somebody sits moves the place: all are taken
#: to stand.
FEWEST_PAIRS = 5
#: Peaks of the map that are asked for.
_PEAKS = 3
#: Steps from a place to better ones, each halved where none is [m].
_FIRST_STEP_M, _LAST_STEP_M = 0.16, 0.04
_WAYS = np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y], dtype=np.float64)
#: Times that each of several people is moved beside the others.
_ROUNDS = 2


def likeliest_peak(
    observations: Observations,
    maps: PairMaps,
    near: Float[np.ndarray, "1 2"] | None = None,
    reach_m: Float[np.ndarray, "1"] | float = NEAR_M,
) -> Float64[np.ndarray, "1 2"]:
    """Where a single upright person is: of the highest peaks of the map the likeliest.

    Args:
        observations: The frame; without phases, or of fewer than three device pairs that hear
            anything, the highest peak is taken.
        maps: Its matched-filter maps.
        near: Where the person is expected; None for anywhere.
        reach_m: How far around there to look [m].
    """
    count = _PEAKS if observations.kind == "complex" else 1
    peaks = highest_peaks(maps, observations.bounds_m, count, near, reach_m)
    # Within a small reach the others may be on the slope of the highest.
    apart = np.linalg.norm(peaks - peaks[0], axis=1) >= SEPARATION_M
    peaks = np.vstack([peaks[:1], peaks[apart]])
    if len(peaks) == 1:
        return peaks
    evidence = _PlaceEvidence(observations, peaks[0], [])
    if len(evidence.pairs) < FEWEST_TO_CHOOSE:
        return peaks[:1]
    return peaks[[int(np.argmax([evidence.at(place) for place in peaks]))]]


def likeliest_places(
    observations: Observations, bodies: Bodies, axes_xy: Float64[np.ndarray, "body 2"]
) -> Bodies:
    """Bodies moved to where evidence of them rises; who lies stays, or stands if that is likelier.

    Args:
        observations: The frame; without phases, or where fewer than `FEWEST_PAIRS` device pairs
            hear anything, nothing is changed.
        bodies: Where people were found, and who of them lies.
        axes_xy: Where each was found upright [m].
    """
    if observations.kind != "complex" or len(observations.pairs[1]) < FEWEST_PAIRS:
        return bodies
    for _ in range(_ROUNDS if len(bodies) > 1 else 1):
        before = bodies
        for body in range(len(bodies)):
            bodies = _moved(observations, bodies, body, axes_xy[body])
        axes_xy = bodies.axes_xy
        if (axes_xy == before.axes_xy).all():
            break
    return bodies


def _moved(
    observations: Observations, bodies: Bodies, body: int, upright_xy: Float64[np.ndarray, "2"]
) -> Bodies:
    """Bodies, one of whom is where and how it is likeliest."""
    alone = [bodies.only(k) for k in range(len(bodies))]
    one, others = alone[body], alone[:body] + alone[body + 1 :]
    evidence = _PlaceEvidence(observations, upright_xy, others)
    if len(evidence.pairs) < FEWEST_PAIRS:
        return bodies
    here, likely = _climbed(evidence, observations, upright_xy, Bodies.together(others))
    if one.lies[0]:
        if likely <= evidence.of(one):
            return bodies
        return Bodies.together([*alone[:body], Bodies.standing(here[None]), *alone[body + 1 :]])
    axes_xy = bodies.axes_xy.copy()
    axes_xy[body] = here
    return replace(bodies, axes_xy=axes_xy)


def _climbed(
    evidence: _PlaceEvidence,
    observations: Observations,
    here: Float64[np.ndarray, "2"],
    others: Bodies,
) -> tuple[Float64[np.ndarray, "2"], float]:
    """The likeliest place uphill from one, in the room and apart from others."""
    step_m, likely = _FIRST_STEP_M, evidence.at(here)
    while step_m >= _LAST_STEP_M:
        around = here + step_m * _WAYS
        inside = around[in_room(around, observations.bounds_m)]
        tried = [place for place in inside if stands_clear(others, place)]
        values = in_threads(evidence.at, tried)
        best = int(np.argmax(values)) if values else -1
        if values and values[best] > likely:
            here, likely = tried[best], values[best]
        else:
            step_m /= 2
    return here, likely


#: Of each device pair the covariances of a body's straight echoes, and of those off one wall.
_Parts: TypeAlias = list[
    tuple[Complex64[np.ndarray, "entry entry"], Complex64[np.ndarray, "entry entry"]]
]


class _PlaceEvidence:
    """How likely a frame is with somebody at a place beside others; what was tried is kept."""

    def __init__(
        self, observations: Observations, near: Float64[np.ndarray, "2"], others: list[Bodies]
    ) -> None:
        self._bounds_m = observations.bounds_m
        self._floor_m = float(observations.bounds_m[0, 2])
        pairs = pairs_of(observations, middle_of(Bodies.standing(near[None]), self._floor_m))
        self.pairs = [pair for pair in pairs if pair.change.any()]
        self._others = [self._parts(one) for one in others]
        self._known: dict[tuple[int, int], float] = {}

    def at(self, place: Float64[np.ndarray, "2"]) -> float:
        """Log-likelihood at the likeliest levels, less a constant [nat]."""
        millimetres = np.round(1000 * place).astype(int)
        key = (int(millimetres[0]), int(millimetres[1]))
        if key not in self._known:
            self._known[key] = self.of(Bodies.standing(place[None]))
        return self._known[key]

    def of(self, one: Bodies) -> float:
        """The same for a body that may lie."""
        bodies = [self._parts(one), *self._others]
        return sum(
            Levels.fitted(
                pair.change, [part for body in bodies for part in body[row]]
            ).log_likelihood
            for row, pair in enumerate(self.pairs)
        )

    def _parts(self, one: Bodies) -> _Parts:
        """Covariances of each pair: of straight echoes, and of those by way of one wall."""
        body = ExpectedEchoes.at(one, self._floor_m, self.pairs)
        return [(body.echoes(pair), body.by_bounces(pair, self._bounds_m)) for pair in self.pairs]
