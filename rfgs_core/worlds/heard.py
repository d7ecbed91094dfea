# SPDX-License-Identifier: Apache-2.0
"""What every device pair hears of somebody in a random room: maps to learn from."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float32, Float64

from rfgs_core.encode.body_maps import ArrayEnd, View
from rfgs_core.radio import Radio
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.radio.tissue import normal_reflection, skin_permittivity
from rfgs_core.worlds.echoes import Band, Listener, Seen, mirrored
from rfgs_core.worlds.figure import Figure, Posed, look_cell, seen_among
from rfgs_core.worlds.moments import Acted, acted
from rfgs_core.worlds.room import Room, Sight

#: Of a body in a wall's mirror every fourth facet is enough: its echo is speckle all the same.
EVERY = 4
#: Echoes by way of a wall that come later than this are beyond the map [m].
LATEST_M = 2.2
#: Moments of one motion, so that drawing it pays.
_MOMENTS = 12


class Example(NamedTuple):
    """One moment of one world."""

    views: list[View]
    """The device pairs."""
    maps: Float32[np.ndarray, "pair elevation azimuth range"]
    """Power of each [m⁴], as `body_maps` has it."""
    centre: Float64[np.ndarray, "3"]
    """Centre of the maps [m]."""
    joints: Float64[np.ndarray, "17 3"]
    """The body's joints [m]."""
    family: str
    """Family of the motion."""


def examples(radio: Radio, seed: int) -> Iterator[Example]:
    """Worlds without end, the same for the same seed.

    Args:
        radio: Radio of the devices.
        seed: Seed of everything.
    """
    for done in acted(radio, seed, _MOMENTS):
        yield from hear(radio, done)


def hear(radio: Radio, done: Acted) -> Iterator[Example]:
    """What a radio hears of one motion, moment by moment."""
    figure, family, moments = done
    for pose, room, sight, views, centre in moments:
        weights = band_window(sight.subcarriers, hann)
        band = Band.of(sight.freq_hz, weights, skin_reflection(radio.centre_hz))
        maps = body_echoes(figure, figure.posed(pose), views, centre, band, room, sight)
        yield Example(views, maps, centre, figure.body.joints17(pose), family)


@functools.lru_cache(maxsize=4)
def skin_reflection(centre_hz: float) -> float:
    """Size of the reflection coefficient of skin at a frequency [Hz]."""
    return float(abs(normal_reflection(skin_permittivity(np.array([centre_hz])))[0]))


def body_echoes(
    figure: Figure,
    posed: Posed,
    views: list[View],
    centre: Float64[np.ndarray, "3"],
    band: Band,
    room: Room,
    sight: Sight,
) -> Float32[np.ndarray, "pair elevation azimuth range"]:
    """Maps of one body, direct and by way of one wall on either leg."""
    facets = posed.points, posed.normals, figure.areas_m2
    thin = tuple(np.ascontiguousarray(values[::EVERY]) for values in facets)
    looks = _Looks(facets, thin, _middles(views), room, sight.above_m)
    maps = []
    for view in views:
        listener = Listener.at(centre, view, band)
        out = listener.empty_map()
        a, b = view.pair
        listener.add(out, Seen(*facets, looks.straight(a), looks.straight(b)), view.tx, view.rx)
        for bounce in _by_bounces(view, room, centre):
            wall, lit = bounce.wall, [looks.straight(a)[::EVERY], looks.straight(b)[::EVERY]]
            lit[bounce.side] = looks.by_wall(view.pair[bounce.side], wall)
            gain = float(room.reflects[wall]) * math.sqrt(EVERY)
            listener.add(out, Seen(*thin, *lit), bounce.tx, bounce.rx, gain)
        maps.append(np.abs(out * band.skin) ** 2)
    return np.array(maps, dtype=np.float32)


def _middles(views: list[View]) -> dict[int, Float64[np.ndarray, "3"]]:
    """The middle between each device's transmitter and receiver, from where it sees [m]."""
    sends = {view.pair[0]: view.tx.centre for view in views}
    hears = {view.pair[1]: view.rx.centre for view in views}
    return {
        device: 0.5 * ((hears | sends)[device] + (sends | hears)[device])
        for device in {*sends, *hears}
    }


class _Looks:
    """What devices see of a body, straight and in the mirror of a wall, each asked once."""

    def __init__(
        self,
        facets: tuple[np.ndarray, ...],
        thin: tuple[np.ndarray, ...],
        middles: dict[int, np.ndarray],
        room: Room,
        above_m: np.ndarray,
    ) -> None:
        self._facets, self._thin, self._middles = facets, thin, middles
        self._room, self._above_m = room, above_m
        area = float(facets[2].sum())
        self._cell_m = look_cell(len(facets[0]), area)
        self._thin_cell_m = look_cell(len(thin[0]), area)
        self._known: dict[tuple[int, tuple[int, int] | None], np.ndarray] = {}

    def straight(self, device: int) -> Bool[np.ndarray, "facet"]:
        """Facets that a device sees over the furniture."""
        if (device, None) not in self._known:
            points, normals, _ = self._facets
            seen = seen_among(points, normals, self._middles[device], self._cell_m)
            self._known[device, None] = seen & (points[:, 2] > self._above_m[device])
        return self._known[device, None]

    def by_wall(self, device: int, wall: tuple[int, int]) -> Bool[np.ndarray, "thin"]:
        """Facets of the thinned body that its image behind a wall sees."""
        if (device, wall) not in self._known:
            image = self._middles[device].copy()
            image[wall[0]] = 2.0 * self._room.bounds_m[wall[1], wall[0]] - image[wall[0]]
            points, normals, _ = self._thin
            self._known[device, wall] = seen_among(points, normals, image, self._thin_cell_m)
        return self._known[device, wall]


class _Bounce(NamedTuple):
    """A way by one wall."""

    tx: ArrayEnd
    rx: ArrayEnd
    side: int
    """Which of them is an image: 0 the transmitter, 1 the receiver."""
    wall: tuple[int, int]
    """Axis of the wall, and which of two sides."""


def _by_bounces(view: View, room: Room, centre: Float64[np.ndarray, "3"]) -> Iterator[_Bounce]:
    """The ways of a view by one wall, on either leg."""
    direct_m = view.path_m(centre)
    for axis in range(3):
        for low_or_high in range(2):
            at_m = float(room.bounds_m[low_or_high, axis])
            if room.reflects[axis, low_or_high] == 0.0:
                continue
            for side, (tx, rx) in enumerate(
                ((mirrored(view.tx, axis, at_m), view.rx), (view.tx, mirrored(view.rx, axis, at_m)))
            ):
                path_m = math.dist(tx.centre, centre) + math.dist(rx.centre, centre)
                if path_m - direct_m <= LATEST_M:
                    yield _Bounce(tx, rx, side, (axis, low_or_high))
