# SPDX-License-Identifier: Apache-2.0
"""Frames of whole channels in rooms that share one layout of devices."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch

from rfgs_core.articulated import Body, people
from rfgs_core.pose_networks.lessons import UPRIGHT, Lessons, Part
from rfgs_core.pose_networks.picture import ANTENNAS, pictures
from rfgs_core.radio import Radio, layout
from rfgs_core.radio.placement import place_devices
from rfgs_core.seeds import sub_seed
from rfgs_core.simulate.tracer import FastTracer
from rfgs_core.worlds.cast import Actor, placed
from rfgs_core.worlds.moments import ONE_ROOM_M, VISITORS
from rfgs_core.worlds.world import Place, World, WorldSettings, random_world

#: Frames of one motion, how many a second, and motions in a room of its own.
_FRAMES, _FPS, _MOTIONS = 12, 8.0, 3
#: Frames of a recording in one room, and how many a second.
RECORDED, _RECORDED_FPS = 40, 10.0


@dataclass(frozen=True)
class _Visit:
    """What one person does in one room, motion after motion."""

    world: World
    actors: list[Actor]
    settings: WorldSettings

    def lessons(self, tracer: FastTracer | None = None) -> Lessons:
        """Their frames, traced."""
        tracer = tracer or self.world.tracer(self.settings.depth)
        times = np.arange(self.settings.frames) / self.settings.fps
        csi, joints = [], []
        for actor in self.actors:
            acted = replace(self.world, actors=[actor])
            csi += [tracer.frame_at(acted.vertices(float(time_s))) for time_s in times]
            joints += [acted.joints(float(time_s))[0] for time_s in times]
        elements = layout(self.world.radio, self.world.devices)
        read = pictures(np.stack(csi), tracer.static(), elements)
        return Lessons((torch.from_numpy(read).half(),), torch.from_numpy(np.stack(joints)))


def few_antennas(radio: Radio) -> Radio:
    """The radio with the middle of its arrays alone, which is all that is read."""
    rows, columns = min(radio.rx_rows, ANTENNAS), min(radio.rx_cols, ANTENNAS)
    return replace(radio, rx_rows=rows, rx_cols=columns)


def other_rooms(radio: Radio, place: Place, seed: int, depth: int) -> Iterator[Part]:
    """Parts without end, each of a random room of the same extent with the same devices.

    Args:
        radio: The radio.
        place: Extent and devices that all rooms share.
        seed: Seed of everything.
        depth: Interactions of people's paths.
    """
    radio, settings = few_antennas(radio), WorldSettings(_FRAMES, _FPS, (1, 1), depth)
    for index in itertools.count():
        world = random_world(radio, settings, seed, index, place)
        rng = np.random.default_rng(sub_seed(seed, radio.name, "more motions", index))
        more = _motions(rng, world, world.actors[0].body, settings, _MOTIONS - 1)
        visit = _Visit(world, [*world.actors, *more], settings)
        yield visit.lessons


def one_room(radio: Radio, seed: int, depth: int) -> Iterator[Part]:
    """Recordings without end, all in one room where a few people move in turn, upright.

    Args:
        radio: The radio; its devices stand where its own rule puts them.
        seed: Seed of everything.
        depth: Interactions of people's paths.
    """
    settings = WorldSettings(RECORDED, _RECORDED_FPS, (1, 1), depth, UPRIGHT)
    radio = few_antennas(radio)
    place = Place(ONE_ROOM_M, place_devices(radio, ONE_ROOM_M))
    world = random_world(radio, settings, seed, 0, place)
    rng = np.random.default_rng(sub_seed(seed, radio.name, "visitors"))
    bodies = [people().random(rng) for _ in range(VISITORS)]
    tracers: dict[int, FastTracer] = {}
    for number in itertools.count():
        who = number % VISITORS
        actors = _motions(rng, world, bodies[who], settings, 1)
        if not actors:
            continue
        visit = _Visit(replace(world, actors=actors), actors, settings)

        def made(visit: _Visit = visit, who: int = who) -> Lessons:
            if who not in tracers:
                tracers[who] = visit.world.tracer(depth)
            return visit.lessons(tracers[who])

        yield made


def _motions(
    rng: np.random.Generator, world: World, body: Body, settings: WorldSettings, count: int
) -> list[Actor]:
    """Upright motions for which a room has space once its first person has left."""
    found = []
    for _ in range(count):
        # The first place taken is that of the person whom the world was made for.
        setting = replace(world.setting, taken_m=world.setting.taken_m[1:])
        actor = placed(rng, setting, body, settings.lasts_s, UPRIGHT)
        if actor is not None:
            found.append(actor)
    return found
