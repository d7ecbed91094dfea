# SPDX-License-Identifier: Apache-2.0
"""What every device pair hears of somebody in a random room: maps to learn from."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float32, Float64

from rfgs_core.articulated import Pose, people
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M, ArrayEnd, View, views_of
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.radio.tissue import normal_reflection, skin_permittivity
from rfgs_core.seeds import sub_seed
from rfgs_core.worlds.echoes import Band, Listener, Seen, mirrored
from rfgs_core.worlds.figure import Figure, Posed, seen_from, seen_roughly
from rfgs_core.worlds.motion import FAMILIES, random_motion
from rfgs_core.worlds.motion.curves import Z, about
from rfgs_core.worlds.room import Room, Sight

#: Of a body in a wall's mirror every fourth facet is enough: its echo is speckle all the same.
_EVERY = 4
#: Echoes by way of a wall that come later than this are beyond the map [m].
_LATEST_M = 2.2
#: Antennas nearer to each other than this see the same of a body: of a device, and its images [m].
_SAME_PLACE_M, _SAME_IMAGE_M = 0.1, 0.4
#: The centre of the maps is off the body's own by a deviation between these [m].
_OFF_CENTRE_M = (0.01, 0.08)
#: Moments of one motion, so that drawing it pays.
_MOMENTS = 12
#: Bodies that are made ready at a time, and motions until others take their place.
_CAST, _MOTIONS_PER_CAST = 24, 120
#: How often each family of motions is drawn; others as often as `_OTHERWISE`.
_SHARES = {"walk": 5.0, "gesture": 4.0, "random": 3.0, "walk_gesture": 2.0}
_OTHERWISE = 1.0


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
        yield from _moments(rng, radio, figure, family)


@functools.lru_cache(maxsize=4)
def _skin(centre_hz: float) -> float:
    """Size of the reflection coefficient of skin."""
    return float(abs(normal_reflection(skin_permittivity(np.array([centre_hz])))[0]))


def _moments(
    rng: np.random.Generator, radio: Radio, figure: Figure, family: str
) -> Iterator[Example]:
    """Moments of one motion, each in a room of its own."""
    motion = random_motion(rng, figure.body, family)
    for _ in range(_MOMENTS):
        room = Room.random(rng)
        spot = room.place(rng)
        sight = Sight.random(rng, radio, room, spot)
        if sight is None:
            continue
        band = Band.of(sight.freq_hz, band_window(sight.subcarriers, hann), _skin(radio.centre_hz))
        pose = motion.at(float(rng.uniform(0.0, motion.duration_s)))
        pose = pose.turned(about(Z, float(rng.uniform(-np.pi, np.pi))))
        # Wherever the motion has led, somebody is at this spot now.
        far = figure.posed(pose).centroid(figure.areas_m2)[:2]
        pose = Pose(pose.root + np.append(spot - far, 0.0), pose.turns)
        centre = np.append(spot + rng.normal(0.0, rng.uniform(*_OFF_CENTRE_M), 2), CENTRE_HEIGHT_M)
        views = views_of(sight.layout, sight.links)
        maps = body_echoes(figure, figure.posed(pose), views, centre, band, room, sight)
        yield Example(views, maps, centre, figure.body.joints17(pose), family)


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
    points, normals, areas = (np.ascontiguousarray(values[::_EVERY]) for values in facets)
    direct = _Sights(lambda place: seen_from(posed, figure.body.faces, place), _SAME_PLACE_M)
    by_bounces = _Sights(lambda place: seen_roughly(points, normals, place, centre), _SAME_IMAGE_M)
    above = [posed.points[:, 2] > height for height in sight.above_m.tolist()]
    maps = []
    for view in views:
        listener = Listener.at(centre, view, band)
        out = listener.empty_map()
        by_tx = direct.of(view.tx.centre) & above[view.pair[0]]
        by_rx = direct.of(view.rx.centre) & above[view.pair[1]]
        listener.add(out, Seen(*facets, by_tx, by_rx), view.tx, view.rx)
        thin_tx, thin_rx = by_tx[::_EVERY], by_rx[::_EVERY]
        for tx, rx, gain in _by_bounces(view, room, centre):
            sent = thin_tx if tx is view.tx else by_bounces.of(tx.centre)
            heard = thin_rx if rx is view.rx else by_bounces.of(rx.centre)
            listener.add(
                out, Seen(points, normals, areas, sent, heard), tx, rx, gain * math.sqrt(_EVERY)
            )
        maps.append(np.abs(out * band.skin) ** 2)
    return np.array(maps, dtype=np.float32)


class _Sights:
    """What places see, asked once of places that are about the same."""

    def __init__(self, see: Callable[[np.ndarray], np.ndarray], same_m: float) -> None:
        self._see, self._same_m = see, same_m
        self._known: list[tuple[np.ndarray, np.ndarray]] = []

    def of(self, place: Float64[np.ndarray, "3"]) -> Bool[np.ndarray, "facet"]:
        """Facets that a place [m] sees."""
        for other, seen in self._known:
            if math.dist(other, place) < self._same_m:
                return seen
        self._known.append((place, self._see(place)))
        return self._known[-1][1]


def _by_bounces(
    view: View, room: Room, centre: Float64[np.ndarray, "3"]
) -> Iterator[tuple[ArrayEnd, ArrayEnd, float]]:
    """Ends of a view with one of them behind a wall, and the wall's amplitude."""
    direct_m = view.path_m(centre)
    for axis in range(3):
        for side in range(2):
            gain, at_m = float(room.reflects[axis, side]), float(room.bounds_m[side, axis])
            if gain == 0.0:
                continue
            for ends in (
                (mirrored(view.tx, axis, at_m), view.rx),
                (view.tx, mirrored(view.rx, axis, at_m)),
            ):
                path_m = math.dist(ends[0].centre, centre) + math.dist(ends[1].centre, centre)
                if path_m - direct_m <= _LATEST_M:
                    yield *ends, gain
