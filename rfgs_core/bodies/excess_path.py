# SPDX-License-Identifier: Apache-2.0
"""How much further waves travel to people and back than straight lines say: through a wall, say.

A slab of refractive index n and thickness d, crossed on both ways, adds about 2 (n − 1) d to every
path over people, and they seem to stand that much behind their places. The lag is the same for
all device pairs where all of them look through the same wall, and the evidence of a body is
greatest where it is taken off (autofocus for through-wall imaging: Ahmad, Amin and Mandapati 2007).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from rfgs_core.bodies.count import count_bodies, loudest_gain
from rfgs_core.bodies.gain import Gain, settled
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Tried first: where nothing is in the way, a body explains less with so much taken off [m], in a
#: narrow corridor 0.93 of what it did, elsewhere half. Through concrete it was 1.02 and more.
PROBE_M = 0.9
#: One frame in which evidence falls below this share says that there is no wall.
CLEARLY_NONE = 0.95
#: Then so many steps are tried of this much [m], and a finer one on both sides of the best.
COARSE_M, COARSE = 0.3, 5
FINE_M = 0.1
#: Frames in which these are tried.
REFINED = 2
#: How often evidence is asked for where the first frame says that there is no wall.
FIRST_LOOK = 2


def excess_path_m(
    frames: Sequence[Observations],
    config: TrainConfig,
    seed: int,
    on_look: Callable[[int], Any] = lambda _left: None,
) -> float:
    """What paths over people are longer than straight lines [m]; zero where nothing says so.

    Args:
        frames: Frames with phases; the first one may be enough to say that there is no wall.
        config: How echoes are taken out of the channel.
        seed: Seed of the Gaussians that stand for these echoes.
        on_look: Called after each look at a frame with how many are left at most.
    """
    looks = _Looks(frames, config, seed, on_look)
    straight, probed = looks.loudest(0, 0.0), looks.loudest(0, PROBE_M)
    if probed <= CLEARLY_NONE * straight or not straight > 0.0:
        return 0.0
    refined, coarse = len(frames[:REFINED]), [COARSE_M * step for step in range(1, COARSE + 1)]
    looks.left = 2 * (len(frames) - 1) + refined * (COARSE + 2 * (COARSE - 1) + 2)
    rises = [looks.loudest(row, PROBE_M) - looks.loudest(row, 0.0) for row in range(1, len(frames))]
    if probed - straight + sum(rises) <= 0.0:
        return 0.0
    for path_m in coarse:
        looks.count(path_m)
    for there, path_m in [*pairwise(coarse), *pairwise(coarse[::-1])]:
        looks.carry(there, path_m)
    best = max(coarse, key=looks.everybody)
    fine = [best - FINE_M, best + FINE_M]
    for path_m in fine:
        looks.carry(best, path_m)
    return round(max((best, *fine), key=looks.everybody), 3)


class _Looks:
    """Evidence at excess paths."""

    def __init__(
        self,
        frames: Sequence[Observations],
        config: TrainConfig,
        seed: int,
        on_look: Callable[[int], Any],
    ) -> None:
        self.frames, self.config, self.seed, self.on_look = frames, config, seed, on_look
        self.left, self.found = FIRST_LOOK, dict[float, list[list[Gain]]]()

    def loudest(self, row: int, path_m: float) -> float:
        """Evidence of the loudest body of one frame [nat]."""
        seen = self.frames[row].lengthened(-path_m)
        nat = loudest_gain(seen)
        self._looked()
        return nat

    def count(self, path_m: float) -> None:
        """Who is in some frames with so much taken off."""
        self.found[path_m] = []
        for frame in self.frames[:REFINED]:
            found = count_bodies(frame.lengthened(-path_m), self.config, self.seed)
            self.found[path_m].append(found)
            self._looked()

    def carry(self, there: float, path_m: float) -> None:
        """Who was found with another excess path, if with this one they explain more.

        Counting is a choice: of two people that one excess path finds, the next may find one, and
        its evidence falls by half. Carried along, evidence is smooth.
        """
        nobody: list[list[Gain]] = [[] for _ in self.found[there]]
        known = self.found.get(path_m, nobody)
        carried = []
        for frame, found in zip(self.frames, self.found[there], strict=False):
            carried.append(settled(frame.lengthened(-path_m), found))
            self._looked()
        self.found[path_m] = [max(both, key=_evidence) for both in zip(known, carried, strict=True)]

    def everybody(self, path_m: float) -> float:
        """Evidence of everybody in some frames [nat]: whoever is left out would draw the others."""
        return sum(map(_evidence, self.found[path_m]))

    def _looked(self) -> None:
        self.left = max(self.left - 1, 0)
        self.on_look(self.left)


def _evidence(found: list[Gain]) -> float:
    """Of some bodies [nat]."""
    return sum(one.nat for one in found)
