# SPDX-License-Identifier: Apache-2.0
"""People of a random world: who they are, what they do, and where they have room for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.articulated import Body, Pose, people
from rfgs_core.articulated.bones import BONE_OF_JOINT, PARENTS
from rfgs_core.errors import RfgsError
from rfgs_core.skeleton import JOINTS
from rfgs_core.worlds.furniture import Setting
from rfgs_core.worlds.motion import FAMILIES, Motion, random_motion
from rfgs_core.worlds.motion.curves import Z, about

#: Stairs would need stairs.
FAMILIES_ON_FLOORS = tuple(family for family in FAMILIES if family != "stairs")
#: Nobody moves nearer to walls, furniture and others than this, from joints on [m].
REACH_M = 0.3
#: Share of children; looks at a motion while a place is sought for it.
_CHILDREN, _LOOKS = 0.12, 7
#: Motions tried, places tried for each; what carries somebody may rise by this [m].
_MOTIONS, _PLACES, _LEVEL_M = 12, 25, 0.01
#: What somebody lies on ends this far below the skin [m].
_UNDER_SKIN_M = 0.02


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

    def pose(self, time_s: float) -> Pose:
        """The pose at a time of the world [s]."""
        pose = self.motion.at(self.start_s + time_s).turned(about(Z, self.turn_rad))
        return Pose(pose.root + np.append(self.shift_m, 0.0), pose.turns)


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
    families: tuple[str, ...] = FAMILIES_ON_FLOORS,
) -> list[Actor]:
    """People who find room for what they do; takes their places on the floor.

    Args:
        rng: Where chance comes from.
        setting: The room; beds are added to it.
        count: How many people.
        lasts_s: How long the world lasts [s].
        families: What they may do.

    Raises:
        RfgsError: Somebody finds no room.
    """
    actors = []
    for _ in range(count):
        body = people().random(rng, child=bool(rng.random() < _CHILDREN))
        actor = _placed(rng, setting, body, lasts_s, families)
        if actor is None:
            raise RfgsError(
                f"no room for {count} people in {np.ptp(setting.bounds_m, axis=0).round(1)} m"
            )
        actors.append(actor)
    return actors


def _placed(
    rng: np.random.Generator,
    setting: Setting,
    body: Body,
    lasts_s: float,
    families: tuple[str, ...],
) -> Actor | None:
    for _ in range(_MOTIONS):
        motion = random_motion(rng, body, str(rng.choice(families)))
        start_s = float(rng.uniform(0.0, max(motion.duration_s - lasts_s, 0.0)))
        for _ in range(_PLACES):
            turn = float(rng.uniform(-np.pi, np.pi))
            actor = _somewhere(rng, setting, Actor(body, motion, start_s, turn, np.zeros(2)))
            reach = None if actor is None else swept(actor, lasts_s)
            if actor is None or reach is None or not _fits(setting, actor, reach, lasts_s):
                continue
            setting.taken_m.append(reach[:, :2])
            _add_bed(setting, actor, reach, lasts_s)
            return actor
    return None


def _somewhere(rng: np.random.Generator, setting: Setting, actor: Actor) -> Actor:
    """The actor with the first pose anywhere in the room."""
    low, high = setting.bounds_m[0, :2] + REACH_M, setting.bounds_m[1, :2] - REACH_M
    here = actor.body.joints17(actor.pose(0.0))[0, :2]
    shift = rng.uniform(low, high) - here
    return Actor(actor.body, actor.motion, actor.start_s, actor.turn_rad, shift)


def swept(actor: Actor, lasts_s: float) -> Float64[np.ndarray, "2 3"]:
    """Box around all joints of an actor over time, with `REACH_M` around them [m]."""
    times = np.linspace(0.0, lasts_s, _LOOKS)
    joints = np.concatenate([actor.body.joints17(actor.pose(time_s)) for time_s in times])
    return np.array([joints.min(axis=0) - REACH_M, joints.max(axis=0) + REACH_M])


def _fits(setting: Setting, actor: Actor, reach_m: np.ndarray, lasts_s: float) -> bool:
    """Whether an actor stays within the room, clear of the others, and on one level."""
    low, high = setting.bounds_m
    inside = (reach_m[0, :2] >= low[:2]).all() and (reach_m[1] <= high).all()
    level = _floors(actor, lasts_s)
    return bool(
        inside and np.ptp(level) <= _LEVEL_M and setting.free(reach_m[0, :2], reach_m[1, :2], 0.0)
    )


def _floors(actor: Actor, lasts_s: float) -> Float64[np.ndarray, "sample"]:
    """Heights of what carries the actor while the world lasts [m]."""
    from rfgs_core.worlds.motion.motion import RATE_HZ

    first = int(actor.start_s * RATE_HZ)
    return actor.motion.floor_m[first : first + int(lasts_s * RATE_HZ) + 2]


def _add_bed(setting: Setting, actor: Actor, reach_m: np.ndarray, lasts_s: float) -> None:
    """Puts a bed under somebody who does not lie on the floor."""
    top = float(_floors(actor, lasts_s).min()) - _UNDER_SKIN_M
    if top > 4.0 * _UNDER_SKIN_M:
        low, high = reach_m[0].copy(), reach_m[1].copy()
        low[2], high[2] = _UNDER_SKIN_M, top
        setting.add_box(f"bed_{len(setting.parts)}", "chipboard", low, high)


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
