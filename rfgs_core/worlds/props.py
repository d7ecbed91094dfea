# SPDX-License-Identifier: Apache-2.0
"""What motions need to stand on the floor: a chair under who sits, stairs under who climbs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.worlds.motion import Motion
from rfgs_core.worlds.motion.motion import Plate
from rfgs_core.worlds.motion.sitting import SEATED, held_by

#: A seat, and the boards of seat and back [m].
_HALF_DEEP_M, _HALF_WIDE_M, _THICK_M = 0.22, 0.2, 0.04
#: A seat between hands that hang beside it is no narrower than twice this [m].
_LEAST_HALF_WIDE_M = 0.12
#: Buttocks bear up to so far ahead of the pelvis's bone [m].
_BEARS_M = 0.06
#: How high the back is above the seat, and how far boards keep from the skin [m].
_BACK_M, _CLEAR_M = 0.45, 0.02
_LEGS, _SIDES = ("upperleg", "lowerleg", "foot"), ("left", "right")
#: Between the instants at which a motion is looked at [s].
_STEP_S = 0.1


class Prop(NamedTuple):
    """A board of something that stands on the floor."""

    name: str
    """What it is a part of."""
    material: str
    """Of what."""
    plate: Plate
    """Where, in the motion's world."""


def props_of(body: Body, motion: Motion) -> list[Prop]:
    """What a motion needs beside floor and bed; nothing for most.

    Args:
        body: Who moves.
        motion: What he or she does, at any time of it.
    """
    if motion.family == "sit":
        return [Prop("chair", "wood", plate) for plate in _chair(body, motion)]
    return [Prop("stairs", "wood", plate) for plate in motion.plates]


def _chair(body: Body, motion: Motion) -> list[Plate]:
    """Seat and back, just clear of the skin at all times; legs are thin, as those of tables."""
    times = np.arange(0.0, motion.duration_s + 0.5 * _STEP_S, _STEP_S)
    # [instant, vertex, 3]
    skins = np.stack([body.skin(motion.at(float(time_s))) for time_s in times]).astype(np.float64)
    x, y, _ = motion.root[motion.root[:, 2].argmin()]
    aside = np.abs(skins[..., 1] - y) < _HALF_WIDE_M
    over = aside & (skins[..., 0] > x - _HALF_DEEP_M) & (skins[..., 0] < x + _BEARS_M)
    top = float(skins[over & held_by(body, *SEATED), 2].min()) - _CLEAR_M
    height = skins[..., 2]
    legs = held_by(body, *(f"{part}_{s}" for part in _LEGS for s in _SIDES))
    level = (height > top - _THICK_M - _CLEAR_M) & (height < top + _CLEAR_M)
    # Thighs that slope down, and calves, end the seat.
    ahead = aside & legs & level & (skins[..., 0] > x + _BEARS_M)
    front = min(x + _HALF_DEEP_M, skins[ahead, 0].min(initial=np.inf) - _CLEAR_M)
    behind = aside & (height > top) & (height < top + _BACK_M + _CLEAR_M)
    back = skins[behind, 0].min(initial=x - _HALF_DEEP_M) - _CLEAR_M
    hands = held_by(body, *(f"{part}_{s}" for part in ("lowerarm", "hand") for s in _SIDES))
    beside = hands & level & (skins[..., 0] > back) & (skins[..., 0] < front + _CLEAR_M)
    wide = np.abs(skins[beside, 1] - y).min(initial=_HALF_WIDE_M + _CLEAR_M) - _CLEAR_M
    wide = max(float(wide), _LEAST_HALF_WIDE_M)
    low, high = y - wide, y + wide
    return [
        Plate((back, low, top - _THICK_M), (float(front), high, top)),
        Plate((back - _THICK_M, low, top - _THICK_M), (back, high, top + _BACK_M)),
    ]
