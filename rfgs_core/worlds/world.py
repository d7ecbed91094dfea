# SPDX-License-Identifier: Apache-2.0
"""Whole random worlds: a room, furniture, devices and people who move, and what radios hear there.

Example:
    for sounding in soundings(preset("wifi"), WorldSettings(frames=4), seed=0):
        sounding.csi  # complex64, (frame, tx, rx, subcarrier)
        sounding.world.joints(0.0)  # (person, 17, 3)
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex64, Float32, Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio
from rfgs_core.radio.check import too_far
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.placement import CORNERS, place_devices
from rfgs_core.seeds import sub_seed
from rfgs_core.simulate.geometry.room import SlabMaterial
from rfgs_core.simulate.surface.edges import UNSAID
from rfgs_core.simulate.surface.movers import Movers
from rfgs_core.simulate.tracer import FastTracer
from rfgs_core.worlds.cast import Actor, cast_of, segment_centres, segments
from rfgs_core.worlds.furniture import SKIN, Setting, empty_setting, furnish
from rfgs_core.worlds.motion import FAMILIES, RECORDED, KeptRecording
from rfgs_core.worlds.room import IN_CORNERS, anywhere

#: Devices of a world, fewest and most, and their heights in corners [m].
_DEVICES, _HEIGHTS_M = (3, 6), (0.4, 2.4)
#: Rooms drawn until everybody finds a place.
_ROOMS = 40
#: Furniture keeps this far from a device [m].
_AROUND_DEVICE_M = 0.3
#: And so do beds, chairs and stairs, which are there before [m].
_FROM_DEVICE_M = 0.1


@dataclass(frozen=True)
class WorldSettings:
    """What random worlds have in common."""

    frames: int = 8
    """Frames of each."""
    fps: float = 10.0
    """Frames per second."""
    people: tuple[int, int] = (1, 2)
    """Fewest and most people."""
    depth: int = 2
    """Interactions of people's paths."""
    families: tuple[str, ...] = FAMILIES
    """What people may do; `recorded` for what `recordings` hold."""
    recordings: tuple[KeptRecording, ...] = ()
    """Motion capture."""

    @property
    def lasts_s(self) -> float:
        """From the first frame to half a frame after the last [s]."""
        return (self.frames - 0.5) / self.fps

    def check(self) -> None:
        """Refuses settings that no world has.

        Raises:
            RfgsError: A number is out of range, or a family is not known.
        """
        fewest, most = self.people
        if not 1 <= fewest <= most <= 4:
            raise RfgsError(f"people {fewest}:{most}: expected FEWEST:MOST within 1 and 4")
        if not 1 <= self.frames <= 1000:
            raise RfgsError(f"frames {self.frames}: expected 1 to 1000")
        if not (np.isfinite(self.fps) and 0.1 <= self.fps <= 1000.0):
            raise RfgsError(f"fps {self.fps}: expected 0.1 to 1000 frames per second")
        if not 1 <= self.depth <= 3:
            raise RfgsError(f"depth {self.depth}: expected 1, 2 or 3")
        unknown = sorted(set(self.families) - {*FAMILIES, RECORDED})
        if unknown or not self.families:
            raise RfgsError(
                f"motion {unknown[0] if unknown else ''!r}: expected some of "
                f"{', '.join((*FAMILIES, RECORDED))}"
            )
        if (RECORDED in self.families) != bool(self.recordings):
            raise RfgsError(
                f"motion {RECORDED!r} and recordings: expected both or neither, as in "
                "--motion recorded --recording walk.bvh"
            )
        for recording in self.recordings:
            recording.check()


@dataclass(frozen=True)
class World:
    """A room with devices, and people who move in it."""

    index: int
    """Number of the world; with the seed it decides everything."""
    setting: Setting
    radio: Radio
    """The radio with this world's number of devices."""
    devices: list[DevicePose]
    actors: list[Actor]

    @cached_property
    def segment(self) -> list[np.ndarray]:
        """Joint that each triangle of each person follows."""
        return [segments(actor.body) for actor in self.actors]

    @cached_property
    def movers(self) -> Movers:
        """Everybody, with instances from 1."""
        counts = [len(actor.body.vertices) for actor in self.actors]
        first = np.cumsum([0, *counts[:-1]])
        faces = [a.body.faces + at for a, at in zip(self.actors, first, strict=True)]
        each = [len(part) for part in faces]
        joined = np.concatenate(faces).astype(np.int64)
        return Movers(
            kept=np.arange(sum(counts)),
            rest_vertices=np.concatenate([a.body.vertices for a in self.actors]).astype(np.float32),
            faces=joined,
            material=np.full(len(joined), len(self.setting.materials) - 1, np.int32),
            instance=np.repeat(np.arange(1, len(each) + 1), each).astype(np.int32),
            segment=np.concatenate(self.segment).astype(np.int32),
            edges=np.full((len(joined), 3), UNSAID, np.int8),
        )

    def vertices(self, time_s: float) -> Float32[np.ndarray, "vertex 3"]:
        """Skin of everybody at a time [s], in metres."""
        skins = [actor.body.skin(actor.pose(time_s)) for actor in self.actors]
        return np.concatenate(skins).astype(np.float32)

    def joints(self, time_s: float) -> Float32[np.ndarray, "person 17 3"]:
        """Joints of everybody [m]."""
        rows = [actor.body.joints17(actor.pose(time_s)) for actor in self.actors]
        return np.stack(rows).astype(np.float32)

    def segment_velocity(self, time_s: float, step_s: float) -> Float32[np.ndarray, "person 17 3"]:
        """Velocity of every body segment's skin [m/s], a central difference over a step [s].

        Of half a step where somebody's motion begins or ends, as it is held beyond.
        """
        half = 0.5 * step_s
        rows = []
        for actor, segment in zip(self.actors, self.segment, strict=True):
            begins_s, ends_s = -actor.start_s, actor.motion.duration_s - actor.start_s
            before_s, after_s = max(time_s - half, begins_s), min(time_s + half, ends_s)
            way_m = segment_centres(actor, segment, after_s)
            way_m = way_m - segment_centres(actor, segment, before_s)
            rows.append(way_m / (after_s - before_s) if after_s > before_s else 0.0 * way_m)
        return np.stack(rows).astype(np.float32)

    def tracer(self, depth: int, seed: int = 0) -> FastTracer:
        """The fast tracer of this world."""
        room, radio = self.setting.room(), self.radio
        return FastTracer(
            room, self.movers, Movers.none(), radio, self.devices, depth=depth, seed=seed
        )


@dataclass(frozen=True)
class Place:
    """Extent and devices that worlds share; walls, furniture and people are still drawn."""

    bounds_m: Float64[np.ndarray, "2 3"]
    """Where the sides are [m]; the floor is z = 0."""
    devices: list[DevicePose]


class Sounding(NamedTuple):
    """A world and what its radio hears."""

    world: World
    time_s: Float64[np.ndarray, "frame"]
    csi_static: Complex64[np.ndarray, "tx rx subcarrier"]
    csi: Complex64[np.ndarray, "frame tx rx subcarrier"]


def refuse_radio(radio: Radio) -> None:
    """Refuses radios that random worlds cannot be heard by.

    Raises:
        RfgsError: Its antennas move, or it sends several packets in a frame.
    """
    if radio.antennas_move:
        raise RfgsError(f"radio {radio.name!r}: its antennas move; random worlds have still ones")
    if radio.samples_per_frame != 1:
        raise RfgsError(
            f"radio {radio.name!r}: {radio.samples_per_frame} samples per frame; random worlds "
            "have one, at a higher frame rate"
        )


def random_world(
    radio: Radio, settings: WorldSettings, seed: int, index: int, place: Place | None = None
) -> World:
    """A world, the same for the same radio, settings, seed and index.

    Args:
        radio: Gives band and arrays; how many devices there are is drawn.
        settings: What worlds have in common.
        seed: Root seed.
        index: Number of the world.
        place: Extent and devices; None draws them.

    Raises:
        RfgsError: The radio's antennas move, or people or devices find no room.
    """
    settings.check()
    refuse_radio(radio)
    for attempt in range(_ROOMS):
        rng = np.random.default_rng(sub_seed(seed, radio.name, "world", index, attempt))
        setting = empty_setting(rng, radio, None if place is None else place.bounds_m)
        if too_far(radio, setting.bounds_m):
            continue
        count = int(rng.integers(settings.people[0], settings.people[1] + 1))
        try:
            actors = cast_of(
                rng, setting, count, settings.lasts_s, settings.families, settings.recordings
            )
            kind, devices = _devices(rng, radio, setting, actors, settings, place)
        except RfgsError:
            # Too small for these people, or for the radio's arrays along its walls.
            continue
        stands = [np.array(device.position_m) for device in devices]
        clear = [setting.clear_of_furniture(point, _FROM_DEVICE_M) for point in stands]
        if not devices or not all(clear):
            continue
        for device in devices:
            here = np.array(device.position_m[:2])
            setting.taken_m.append(np.array([here - _AROUND_DEVICE_M, here + _AROUND_DEVICE_M]))
        furnish(rng, setting)
        setting.materials.append(SlabMaterial(SKIN, MATERIALS[SKIN].thickness_m))
        return World(index, setting, kind, devices, actors)
    raise RfgsError(
        f"world {index}: none of {_ROOMS} rooms has space for its people and devices and is small "
        f"enough for radio {radio.name!r}; ask for fewer people or frames, or more subcarriers"
    )


def _devices(
    rng: np.random.Generator,
    radio: Radio,
    setting: Setting,
    actors: list[Actor],
    settings: WorldSettings,
    place: Place | None,
) -> tuple[Radio, list[DevicePose]]:
    """Those of a place, or three to six by the radio's rule or anywhere; none without room.

    Raises:
        RfgsError: The room is too small for the radio's rule.
    """
    if place is not None:
        return replace(radio, num_devices=len(place.devices)), list(place.devices)
    count = int(rng.integers(_DEVICES[0], _DEVICES[1] + 1))
    heights = tuple(float(z) for z in rng.uniform(*_HEIGHTS_M, count))
    kind = replace(
        radio, num_devices=count, inset_m=float(rng.uniform(0.1, 0.4)), heights_m=heights
    )
    if radio.placement != "corners":
        kind = replace(kind, num_devices=radio.num_devices)
        return kind, place_devices(kind, setting.bounds_m)
    if count <= CORNERS and rng.random() < IN_CORNERS:
        return kind, place_devices(kind, setting.bounds_m)
    times = np.linspace(0.0, settings.lasts_s, 5)
    joints = [actor.body.joints17(actor.pose(time_s)) for actor in actors for time_s in times]
    devices = anywhere(rng, setting.bounds_m, np.concatenate(joints)[:, :2], count)
    named = [replace(each, name=f"{radio.name}_{each.name}") for each in devices]
    return kind, named


def sounded(world: World, settings: WorldSettings, seed: int = 0) -> Sounding:
    """Traces a world's frames."""
    tracer = world.tracer(min(settings.depth, world.radio.deepest), seed)
    times = np.arange(settings.frames) / settings.fps
    frames = [tracer.frame_at(world.vertices(float(time_s))) for time_s in times]
    return Sounding(world, times, tracer.static(), np.stack(frames))


def soundings(
    radio: Radio, settings: WorldSettings, seed: int, first: int = 0, step: int = 1
) -> Iterator[Sounding]:
    """Worlds without end, traced as they are asked for; nothing is written.

    Args:
        radio: The radio.
        settings: What worlds have in common.
        seed: Root seed.
        first: Number of the first world.
        step: From one world to the next; workers that share a stream begin one after another.
    """
    for index in itertools.count(first, step):
        yield sounded(random_world(radio, settings, seed, index), settings, seed)
