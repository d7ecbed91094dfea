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
from rfgs_core.worlds.motion import FAMILIES, Motion, random_motion
from rfgs_core.worlds.motion.curves import Z, about
from rfgs_core.worlds.room import Room, Sight

#: The centre of the maps is off the body's own by a deviation between these [m].
_OFF_CENTRE_M = (0.01, 0.12)
#: Bodies that are made ready at a time, and motions until others take their place.
_CAST, _MOTIONS_PER_CAST = 24, 120
#: Where the sides of one room are that many clips share [m], and how many people visit it in turn.
ONE_ROOM_M, VISITORS = np.array([[-2.0, -1.75, 0.0], [2.0, 1.75, 2.7]]), 4
#: There they begin by facing one wall, within this [rad], as volunteers face a radar.
_ONE_WAY_RAD = 0.25 * np.pi
#: Time from frame to frame of a clip, shortest and longest [s].
_APART_S = (0.1, 0.3)
#: Those who move stay this far from walls, and from devices [m].
_FROM_WALL_M, _FROM_DEVICE_M = 0.3, 0.5
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
    for figure, family, motion in _motions(rng, radio, _CAST, _MOTIONS_PER_CAST, FAMILIES):
        times = rng.uniform(0.0, motion.duration_s, count)
        drawn = (_moment(rng, radio, figure, motion.at(float(time_s))) for time_s in times)
        yield Acted(figure, family, [moment for moment in drawn if moment is not None])


def followed(
    radio: Radio,
    seed: int,
    frames: int,
    *,
    one_room: bool = False,
    families: tuple[str, ...] = FAMILIES,
) -> Iterator[Acted]:
    """Clips without end: somebody's consecutive moments in one room, the same for the same seed.

    Args:
        radio: Radio of the devices.
        seed: Seed of everything.
        frames: Moments of each clip, 0.1 to 0.3 s apart; 0.1 s in one room.
        one_room: All clips are in the same room, among the same devices, by the same four people,
            who begin by facing one wall within 45°.
        families: What people may do.
    """
    rng = np.random.default_rng(sub_seed(seed, radio.name, "clips"))
    shared = Room(ONE_ROOM_M, rng.uniform(0.1, 0.75, (3, 2))) if one_room else None
    cast = (VISITORS, None) if one_room else (_CAST, _MOTIONS_PER_CAST)
    for figure, family, motion in _motions(rng, radio, *cast, families):
        room = Room.random(rng) if shared is None else shared
        spot = room.place(rng)
        sight = Sight.random(rng, radio, room, spot) if shared is None else Sight.whole(radio, room)
        times = np.arange(frames) * (_APART_S[0] if one_room else rng.uniform(*_APART_S))
        times += rng.uniform(0.0, max(motion.duration_s - times[-1], 0.0))
        widest = _ONE_WAY_RAD if one_room else np.pi
        turn = about(Z, float(rng.uniform(-widest, widest)))
        poses = [motion.at(float(time_s)).turned(turn) for time_s in times]
        off_m = rng.uniform(*_OFF_CENTRE_M)
        if sight is None:
            continue
        shift = np.append(spot - figure.middle(poses[frames // 2])[:2], 0.0)
        poses = [Pose(pose.root + shift, pose.turns) for pose in poses]
        middles = np.array([figure.middle(pose)[:2] for pose in poses])
        if not _clear(middles, room, sight):
            continue
        views = views_of(sight.layout, sight.links)
        centres = middles + rng.normal(0.0, off_m, middles.shape)
        moments = [
            Moment(pose, room, sight, views, np.append(centre, CENTRE_HEIGHT_M))
            for pose, centre in zip(poses, centres, strict=True)
        ]
        yield Acted(figure, family, moments)


def _clear(middles: Float64[np.ndarray, "frame 2"], room: Room, sight: Sight) -> bool:
    """Whether somebody stays within the room and does not walk into devices."""
    low, high = room.bounds_m[:, :2]
    inside = (middles > low + _FROM_WALL_M) & (middles < high - _FROM_WALL_M)
    away = np.linalg.norm(middles[:, None] - sight.layout.rx_xyz[:, :2], axis=2)
    return bool(inside.all() and away.min() > _FROM_DEVICE_M)


def _motions(
    rng: np.random.Generator,
    radio: Radio,
    cast_size: int,
    renewed: int | None,
    families: tuple[str, ...],
) -> Iterator[tuple[Figure, str, Motion]]:
    """Somebody of a cast and what they do, without end; others come after `renewed` motions."""
    shares = np.array([_SHARES.get(family, _OTHERWISE) for family in families])
    wavelength_m = SPEED_OF_LIGHT / float(radio.freq_hz.max())
    motions = 0
    cast: list[Figure] = []
    while True:
        if not cast or (renewed is not None and motions % renewed == 0):
            drawn = [
                people().random(rng, child=bool(rng.random() < 0.12)) for _ in range(cast_size)
            ]
            cast = [Figure.of(body, wavelength_m) for body in drawn]
        motions += 1
        figure = cast[int(rng.integers(len(cast)))]
        family = str(rng.choice(families, p=shares / shares.sum()))
        yield figure, family, random_motion(rng, figure.body, family)


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
