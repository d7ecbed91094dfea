# SPDX-License-Identifier: Apache-2.0
"""How much further waves travel to people and back than straight lines say: through a wall, say.

A slab of refractive index n and thickness d, crossed on both ways, adds about 2 (n − 1) d to every
path over people, and they seem to stand that much behind their places. The lag is the same for
all device pairs where all of them look through the same wall, and the evidence of a body is
greatest where it is taken off (autofocus for through-wall imaging: Ahmad, Amin and Mandapati 2007).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rfgs_core.bodies.count import count_bodies, loudest_gain
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Tried first: where nothing is in the way, a body explains less with so much taken off [m], in a
#: narrow corridor 0.93 of what it did, elsewhere half. Through concrete it was 1.02 and more.
PROBE_M = 0.9
#: One frame in which evidence falls below this share says that there is no wall.
CLEARLY_NONE = 0.95
#: Then so many steps are tried of this much [m], and finer ones around the best.
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
    looks.left = 2 * (len(frames) - 1) + (COARSE + 2) * len(frames[:REFINED])
    rises = [looks.loudest(row, PROBE_M) - looks.loudest(row, 0.0) for row in range(1, len(frames))]
    if probed - straight + sum(rises) <= 0.0:
        return 0.0
    coarse = [COARSE_M * step for step in range(1, COARSE + 1)]
    best = max(coarse, key=looks.everybody)
    return round(max((best, best - FINE_M, best + FINE_M), key=looks.everybody), 3)


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
        self.left, self.known = FIRST_LOOK, dict[float, float]()

    def loudest(self, row: int, path_m: float) -> float:
        """Evidence of the loudest body of one frame [nat]."""
        seen = self.frames[row].lengthened(-path_m)
        return self._looked(loudest_gain(seen))

    def everybody(self, path_m: float) -> float:
        """Evidence of everybody in some frames [nat]: whoever is left out would draw the others."""
        if path_m not in self.known:
            self.known[path_m] = 0.0
            for frame in self.frames[:REFINED]:
                found = count_bodies(frame.lengthened(-path_m), self.config, self.seed)
                self.known[path_m] += self._looked(sum(one.nat for one in found))
        return self.known[path_m]

    def _looked(self, nat: float) -> float:
        self.left = max(self.left - 1, 0)
        self.on_look(self.left)
        return nat
