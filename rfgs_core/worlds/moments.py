# SPDX-License-Identifier: Apache-2.0
"""Moments of people in random rooms: who, where, how, and who listens with what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.articulated import Pose, people
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, View, views_of
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.figure import Figure
from rfgs_core.worlds.motion import FAMILIES, random_motion
from rfgs_core.worlds.motion.curves import Z, about
from rfgs_core.worlds.room import Room, Sight

#: The centre of the maps is off the body's own by a deviation between these [m].
_OFF_CENTRE_M = (0.01, 0.08)
#: Bodies that are made ready at a time, and motions until others take their place.
_CAST, _MOTIONS_PER_CAST = 24, 120
#: How often each family of motions is drawn; others as often as `_OTHERWISE`.
_SHARES = {"walk": 5.0, "gesture": 4.0, "random": 3.0, "walk_gesture": 2.0}
_OTHERWISE = 1.0


class Moment(NamedTuple):
    """Somebody in a room at one moment, and who listens."""

    pose: Pose
    room: Room
    sight: Sight
    views: list[View]
    """The device pairs."""
    centre: Float64[np.ndarray, "3"]
    """Centre of the maps [m]."""


class Acted(NamedTuple):
    """One motion of somebody, each moment of it in a room of its own."""

    figure: Figure
    family: str
    """Family of the motion."""
    moments: list[Moment]


def acted(radio: Radio, seed: int, count: int) -> Iterator[Acted]:
    """Motions without end, the same for the same seed.

    Args:
        radio: Radio of the devices.
        seed: Seed of everything.
        count: Moments of each motion; some are left out where devices found no place.
    """
    rng = np.random.default_rng(sub_seed(seed, radio.name, "worlds"))
    shares = np.array([_SHARES.get(family, _OTHERWISE) for family in FAMILIES])
    wavelength_m = SPEED_OF_LIGHT / float(radio.freq_hz.max())
    motions = 0
    cast: list[Figure] = []
    while True:
        if motions % _MOTIONS_PER_CAST == 0:
            drawn = [people().random(rng, child=bool(rng.random() < 0.12)) for _ in range(_CAST)]
            cast = [Figure.of(body, wavelength_m) for body in drawn]
        motions += 1
        figure = cast[int(rng.integers(len(cast)))]
        family = str(rng.choice(FAMILIES, p=shares / shares.sum()))
        motion = random_motion(rng, figure.body, family)
        times = rng.uniform(0.0, motion.duration_s, count)
        drawn = (_moment(rng, radio, figure, motion.at(float(time_s))) for time_s in times)
        yield Acted(figure, family, [moment for moment in drawn if moment is not None])


def _moment(rng: np.random.Generator, radio: Radio, figure: Figure, pose: Pose) -> Moment | None:
    """A pose in a random room; None where devices found no place."""
    room = Room.random(rng)
    spot = room.place(rng)
    sight = Sight.random(rng, radio, room, spot)
    if sight is None:
        return None
    pose = pose.turned(about(Z, float(rng.uniform(-np.pi, np.pi))))
    # Wherever the motion has led, somebody is at this spot now.
    shift = spot - figure.middle(pose)[:2]
    pose = Pose(pose.root + np.append(shift, 0.0), pose.turns)
    centre = np.append(spot + rng.normal(0.0, rng.uniform(*_OFF_CENTRE_M), 2), CENTRE_HEIGHT_M)
    return Moment(pose, room, sight, views_of(sight.layout, sight.links), centre)
