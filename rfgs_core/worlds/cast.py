# SPDX-License-Identifier: Apache-2.0
"""People of a random world: who they are, what they do, and where they have room for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.articulated.bones import BONE_OF_JOINT, PARENTS
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.furniture import Setting
from rfgs_core.worlds.motion import (
    FAMILIES,
    RECORDED,
    KeptRecording,
    Motion,
    random_motion,
    recorded_motion,
)
from rfgs_core.worlds.motion.curves import Z, about
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.props import Prop, props_of

#: Nobody moves nearer to walls, furniture and others than this, from joints on [m].
REACH_M = 0.3
#: Share of children; looks at a motion while a place is sought for it.
_CHILDREN, _LOOKS = 0.12, 7
#: Motions tried, places tried for each; what carries somebody may rise by this [m].
_MOTIONS, _PLACES, _LEVEL_M = 12, 25, 0.01
#: What somebody lies on ends this far below the skin [m].
_UNDER_SKIN_M = 0.02
#: Chairs and stairs stand at least this far from walls [m].
_FROM_WALL_M = 0.05


@dataclass(frozen=True)
class Actor:
    """Somebody who does something somewhere."""

    body: Body
    motion: Motion
    start_s: float
    """Time of the motion when the world begins [s]."""
    turn_rad: float
    """How far the motion is turned, about the world's z axis."""
    shift_m: Float64[np.ndarray, "2"]
    """Where its origin is then put [m]."""
    lift_m: float = 0.0
    """And how far above the floor: those who go down stairs begin on top of them [m]."""

    def pose(self, time_s: float) -> Pose:
        """The pose at a time of the world [s]."""
        pose = self.motion.at(self.start_s + time_s).turned(about(Z, self.turn_rad))
        return Pose(pose.root + np.append(self.shift_m, self.lift_m), pose.turns)


def segments(body: Body) -> Int64[np.ndarray, "triangle"]:
    """Joint that each triangle of the skin follows: that of the bone that holds most of it."""
    bone, weight = body.weights
    heaviest = np.take_along_axis(bone, weight.argmax(axis=1)[:, None], axis=1)[:, 0]
    first, second, third = _joint_of_bone()[heaviest.astype(np.int64)][body.faces].T
    return np.where(second == third, second, first)


def _joint_of_bone() -> Int64[np.ndarray, "bone"]:
    """Joint at which each bone begins, else that of the nearest bone above which has one."""
    known = {int(bone): joint for joint, bone in enumerate(BONE_OF_JOINT)}
    out: list[int] = []
    for row, parent in enumerate(PARENTS):
        out.append(known.get(row, out[parent] if parent >= 0 else 0))
    return np.array(out)


def cast_of(
    rng: np.random.Generator,
    setting: Setting,
    count: int,
    lasts_s: float,
    families: tuple[str, ...] = FAMILIES,
    recordings: tuple[KeptRecording, ...] = (),
) -> list[Actor]:
    """People who find room for what they do; takes their places on the floor.

    Args:
        rng: Where chance comes from.
        setting: The room; beds, chairs and stairs are added to it.
        count: How many people.
        lasts_s: How long the world lasts [s].
        families: What they may do.
        recordings: What those do whose family is `recorded`.

    Raises:
        RfgsError: Somebody finds no room.
    """
    actors = []
    for _ in range(count):
        body = people().random(rng, child=bool(rng.random() < _CHILDREN))
        actor = placed(rng, setting, body, lasts_s, families, recordings)
        if actor is None:
            raise RfgsError(
                f"no room for {count} people in {np.ptp(setting.bounds_m, axis=0).round(1)} m"
            )
        actors.append(actor)
    return actors


def placed(
    rng: np.random.Generator,
    setting: Setting,
    body: Body,
    lasts_s: float,
    families: tuple[str, ...],
    recordings: tuple[KeptRecording, ...] = (),
) -> Actor | None:
    """Somebody who does one of some things where there is room; None where there is none.

    Args:
        rng: Where chance comes from.
        setting: The room; the place is taken, and a bed, chair or stairs are added to it.
        body: Who.
        lasts_s: How long it lasts [s].
        families: What may be done.
        recordings: What is done if that is `recorded`.
    """
    for _ in range(_MOTIONS):
        family = str(rng.choice(families))
        if family == RECORDED:
            kept = recordings[int(rng.integers(len(recordings)))]
            # Of what lasts for minutes only what the world shows is put on a body.
            begin_s = float(rng.uniform(0.0, max(kept.duration_s - lasts_s, 0.0)))
            motion = recorded_motion(body, kept.between(begin_s, begin_s + lasts_s))
        else:
            motion = random_motion(rng, body, family)
        start_s = float(rng.uniform(0.0, max(motion.duration_s - lasts_s, 0.0)))
        props = props_of(body, motion)
        lift_m = max(-float(motion.floor_m.min()), 0.0)
        for _ in range(_PLACES):
            turn = float(rng.uniform(-np.pi, np.pi))
            if motion.plates:
                # Stairs are long, and run along a wall.
                turn = 0.5 * np.pi * round(turn / (0.5 * np.pi))
            actor = Actor(body, motion, start_s, turn, np.zeros(2), lift_m)
            actor = _somewhere(rng, setting, actor)
            reach = _with_props(swept(actor, lasts_s), actor, props)
            if not _fits(setting, actor, reach, lasts_s):
                continue
            setting.taken_m.append(reach[:, :2])
            _add_bed(setting, actor, reach, lasts_s)
            _add_props(setting, actor, props)
            return actor
    return None


def _somewhere(rng: np.random.Generator, setting: Setting, actor: Actor) -> Actor:
    """The actor with the first pose anywhere in the room."""
    low, high = setting.bounds_m[0, :2] + REACH_M, setting.bounds_m[1, :2] - REACH_M
    here = actor.body.joints17(actor.pose(0.0))[0, :2]
    return replace(actor, shift_m=rng.uniform(low, high) - here)


def swept(actor: Actor, lasts_s: float) -> Float64[np.ndarray, "2 3"]:
    """Box around all joints of an actor over time, with `REACH_M` around them [m]."""
    times = np.linspace(0.0, lasts_s, _LOOKS)
    joints = np.concatenate([actor.body.joints17(actor.pose(time_s)) for time_s in times])
    return np.array([joints.min(axis=0) - REACH_M, joints.max(axis=0) + REACH_M])


def _with_props(reach_m: np.ndarray, actor: Actor, props: list[Prop]) -> np.ndarray:
    """The box around an actor [2, 3], grown to hold her or his chair or stairs [m]."""
    if not props:
        return reach_m
    plates = np.array([prop.plate for prop in props]).reshape(-1, 2, 3)
    x, y = (plates[:, [[0, 0], [1, 1]], 0].ravel(), plates[:, [[0, 1], [0, 1]], 1].ravel())
    flat = np.stack([x, y], axis=1) @ about(Z, actor.turn_rad)[:2, :2].T + actor.shift_m
    out = reach_m.copy()
    out[0, :2] = np.minimum(out[0, :2], flat.min(axis=0) - _FROM_WALL_M)
    out[1, :2] = np.maximum(out[1, :2], flat.max(axis=0) + _FROM_WALL_M)
    return out


def _fits(setting: Setting, actor: Actor, reach_m: np.ndarray, lasts_s: float) -> bool:
    """Whether an actor stays within the room, clear of the others, and on one level."""
    low, high = setting.bounds_m
    inside = (reach_m[0, :2] >= low[:2]).all() and (reach_m[1] <= high).all()
    level = bool(actor.motion.plates) or np.ptp(_floors(actor, lasts_s)) <= _LEVEL_M
    return bool(inside and level and setting.free(reach_m[0, :2], reach_m[1, :2], 0.0))


def _floors(actor: Actor, lasts_s: float) -> Float64[np.ndarray, "sample"]:
    """Heights of what carries the actor while the world lasts [m]."""
    first = int(actor.start_s * RATE_HZ)
    return actor.motion.floor_m[first : first + int(lasts_s * RATE_HZ) + 2]


def _add_bed(setting: Setting, actor: Actor, reach_m: np.ndarray, lasts_s: float) -> None:
    """Puts a bed under somebody who does not lie on the floor."""
    if actor.motion.plates:
        return
    top = float(_floors(actor, lasts_s).min()) - _UNDER_SKIN_M
    if top > 4.0 * _UNDER_SKIN_M:
        low, high = reach_m[0].copy(), reach_m[1].copy()
        low[2], high[2] = _UNDER_SKIN_M, top
        setting.add_box(f"bed_{len(setting.parts)}", "chipboard", low, high)


def _add_props(setting: Setting, actor: Actor, props: list[Prop]) -> None:
    """Puts chair or stairs where the actor needs them."""
    shift_m = np.append(actor.shift_m, actor.lift_m)
    for prop in props:
        name = f"{prop.name}_{len(setting.parts)}"
        low, high = np.array(prop.plate)
        setting.add_box(name, prop.material, low, high, actor.turn_rad, shift_m)


def segment_centres(
    actor: Actor, segment: np.ndarray, time_s: float
) -> Float64[np.ndarray, "17 3"]:
    """Centre of the skin of every body segment, weighted by area [m]; joints where there is none.

    Args:
        actor: Who.
        segment: Of `segments(actor.body)`, shape (triangle,).
        time_s: When [s].
    """
    pose = actor.pose(time_s)
    corners = actor.body.skin(pose).astype(np.float64)[actor.body.faces]
    sides = corners[:, 1:] - corners[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    total = np.bincount(segment, area, len(JOINTS))
    out = actor.body.joints17(pose).astype(np.float64)
    middle = corners.mean(axis=1)
    sums = np.stack(
        [np.bincount(segment, area * middle[:, axis], len(JOINTS)) for axis in range(3)], axis=1
    )
    out[total > 0] = sums[total > 0] / total[total > 0, None]
    return out
