# SPDX-License-Identifier: Apache-2.0
"""On the floor or a bed: lying on back, belly or side, and falling there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rfgs_core.articulated import Body
from rfgs_core.articulated.bones import bone
from rfgs_core.worlds.motion.arms import ArmPose, Shoulder, set_arm
from rfgs_core.worlds.motion.curves import X, Y, Z, about, keyed, noise, smoothed, turned
from rfgs_core.worlds.motion.motion import RATE_HZ
from rfgs_core.worlds.motion.track import SIDES, Track

#: How far a body is rolled from its back, to its left [rad].
_ROLL = {"back": 0.0, "left": 0.5 * np.pi, "belly": np.pi, "right": -0.5 * np.pi}
#: Most that legs are bent while the body rolls: hip, knee, ankle, abduction, rotation [rad].
_ROLLING_LEG = np.array([0.35, 0.5, 0.0, 0.1, 0.3])
#: Arms may be this far below what they lie beside [m].
_UNDER_M = 0.03


@dataclass(frozen=True)
class Lying:
    """How somebody lies."""

    side: str
    """What is below: `back`, `belly`, `left` or `right`."""
    legs: np.ndarray
    """Hip, knee, ankle, abduction and rotation of both legs [rad], shape [2, 5]."""
    arms: tuple[ArmPose, ArmPose]
    """Both arms."""
    trunk: np.ndarray
    """Flexion, bend and twist of the trunk [rad], shape [3]."""
    head: np.ndarray
    """The same of the head, shape [3]."""


def lying(
    rng: np.random.Generator, body: Body, side: str, start: tuple[ArmPose, ArmPose] | None = None
) -> Lying:
    """A random way to lie on one side of the body, with arms that come from `start`."""
    legs = np.stack([_leg(rng, side) for _ in SIDES])
    if side in ("left", "right"):
        # Both legs are drawn up alike.
        legs[1] = legs[0] + rng.normal(0.0, 0.12, 5) * [1, 1, 1, 0, 0]
        legs[:, 1] = np.maximum(legs[:, 1], 0.05)
    come = start or (None, None)
    arms = [_arm(rng, Shoulder(body, one), side, come[row]) for row, one in enumerate(SIDES)]
    curl = rng.uniform(0.1, 0.5) if side in ("left", "right") else rng.uniform(-0.05, 0.2)
    turn = rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.1) if side == "belly" else rng.normal() / 3
    trunk = np.array([curl, rng.normal(0.0, 0.05), rng.normal(0.0, 0.05)])
    head = np.array([rng.uniform(0.0, 0.35) * (side == "back"), 0.0, np.clip(turn, -1.1, 1.1)])
    return Lying(side, legs, (arms[0], arms[1]), trunk, head)


def lie(rng: np.random.Generator, body: Body) -> Track:
    """Lies on the floor or a bed, moves now and then, may turn over."""
    track = Track(body, rng.uniform(5.0, 10.0))
    track.floor_m[:] = rng.choice([0.0, rng.uniform(0.3, 0.6)], p=[0.4, 0.6])
    sides = list(_ROLL)
    at = int(rng.choice(4, p=[0.45, 0.2, 0.15, 0.2]))
    ways, rolls = [lying(rng, body, sides[at])], [_ROLL[sides[at]]]
    knots, time_s = [0.0], rng.uniform(0.2, 2.0)
    knots.append(time_s)
    ways.append(ways[0])
    rolls.append(rolls[0])
    while time_s < track.times[-1] - 2.0:
        turning = int(rng.choice([0, 1, -1], p=[0.6, 0.2, 0.2]))
        at += turning
        stages = _stages(rng, body, ways[-1], sides[at % 4])
        for after, way, share in stages:
            time_s += after
            knots.append(time_s)
            ways.append(way)
            rolls.append(rolls[-1] + 0.5 * np.pi * turning * share)
    _set(track, knots, ways, rng)
    roll = keyed(track.times, knots, np.array(rolls)) + 0.02 * noise(rng, track.times, 0.3)
    heading = rng.uniform(-np.pi, np.pi)
    # The head lies towards -x before the heading.
    track.local[:, 0] = about(Z, heading) @ about(Y, -0.5 * np.pi) @ about(Z, roll)
    _middle_at(track, np.zeros((len(track.times), 2)))
    track.ground(width_s=0.06)
    return track


def _stages(
    rng: np.random.Generator, body: Body, now: Lying, side: str
) -> list[tuple[float, Lying, float]]:
    """How somebody comes to lie on a side: times [s], ways to lie, shares of the turn there."""
    stay = rng.uniform(0.1, 2.0)
    if side == now.side:
        new = lying(rng, body, side, now.arms)
        if rng.uniform() < 0.5:
            # Only the arms move.
            new = replace(new, legs=now.legs, trunk=now.trunk)
        return [(rng.uniform(0.8, 2.0), new, 0.0), (stay, new, 0.0)]
    # Arms come to the chest and legs are stretched first, or they would be rolled over.
    drawn = _at_the_chest(rng, body)
    new = lying(rng, body, side, drawn)
    before = replace(now, arms=drawn, legs=np.minimum(now.legs, _ROLLING_LEG))
    after = replace(new, arms=drawn, legs=np.minimum(new.legs, _ROLLING_LEG))
    roll_s = rng.uniform(0.9, 1.8)
    return [(0.8, before, 0.1), (roll_s, after, 0.9), (0.8, new, 0.0), (stay, new, 0.0)]


def fall(rng: np.random.Generator, body: Body) -> Track:
    """Stands, falls in 0.6 to 1.2 s and lies."""
    before, lasts = rng.uniform(0.4, 2.0), rng.uniform(0.6, 1.2)
    track = Track(body, before + lasts + rng.uniform(1.0, 3.0))
    way = str(rng.choice(["ahead", "back", "left", "right"]))
    down = {"ahead": "belly"}.get(way, way)
    arc = {
        "ahead": 0.5 * np.pi * Y,
        "back": -0.5 * np.pi * Y,
        "left": -0.5 * np.pi * X,
        "right": 0.5 * np.pi * X,
    }[way]
    end = lying(rng, body, down)
    hit = before + lasts
    knots = [0.0, before, before + 0.55 * lasts, hit + 0.15, hit + rng.uniform(0.6, 1.2)]
    start, midway = _upright(rng, body, 0.05), _upright(rng, body, rng.uniform(0.3, 0.9))
    _set(track, knots, [start, start, _flailing(rng, body, midway, way), end, end], rng)
    # Tipping over goes faster and faster until the floor ends it.
    share = np.clip((track.times - before) / lasts, 0.0, 1.0) ** rng.uniform(1.7, 2.2)
    share = smoothed(share, RATE_HZ, 0.04)
    twist = rng.normal(0.0, 0.3) * share
    track.local[:, 0] = about(Z, twist) @ turned(share[:, None] * arc)
    _feet_at(track)
    track.ground(width_s=0.04)
    return track


def _leg(rng: np.random.Generator, side: str) -> np.ndarray:
    """Hip, knee, ankle, abduction, rotation of a leg [rad]."""
    if side == "back":
        drawn = rng.choice([0.0, rng.uniform(0.2, 0.9)], p=[0.6, 0.4])
        # The sole stays on the ground: the knee bends by about twice the hip.
        leg = [drawn + 0.05, 2.05 * drawn + 0.08, -0.35 + 0.5 * drawn, rng.uniform(-0.02, 0.25)]
        return np.array([*leg, rng.uniform(0.0, 0.5) * (drawn == 0.0)])
    if side == "belly":
        knee = rng.choice([0.05, rng.uniform(0.2, 1.6)], p=[0.75, 0.25])
        return np.array([0.0, knee, -0.7, rng.uniform(0.0, 0.3), rng.uniform(-0.2, 0.2)])
    hip = rng.uniform(0.1, 1.3)
    return np.array([hip, np.clip(hip + rng.uniform(-0.2, 0.6), 0.05, 2.0), -0.4, -0.05, 0.0])


def _arm(rng: np.random.Generator, shoulder: Shoulder, side: str, start: ArmPose | None) -> ArmPose:
    """A random arm that neither lies nor, coming from `start`, moves under the body."""
    back, front = shoulder.middle[0] - shoulder.half[0], shoulder.middle[0] + shoulder.half[0]
    home = shoulder.hang(0.3, 0.0, 0.5) if side == shoulder.side else shoulder.hang(0.15, 0.15)
    for _ in range(80):
        way = rng.standard_normal(3) * [0.6, 1.0, 1.2]
        far = shoulder.reach_m * rng.uniform(0.5, 1.0)
        target = shoulder.place + far * way / np.linalg.norm(way)
        if side in ("back", "belly"):
            target[0] = np.clip(target[0], back, front + (0.1 if side == "back" else 0.0))
        pose = shoulder.reach(target, rng.uniform(0.2, 1.4))
        if not shoulder.allowed(pose):
            continue
        turns, elbows = shoulder.way(start or pose, pose)
        points = shoulder.points(turns, elbows)
        # Where it begins may be under the body: only the rest of the way counts.
        if _over_ground(shoulder, side, points[len(points) // 2 :]) and (
            shoulder.inside_m(turns[-1:], elbows[-1:])[0] < 0.0
        ):
            return pose
    if start is None:
        return home
    stays = shoulder.points(start.shoulder[None], np.array([start.elbow]))
    return start if _over_ground(shoulder, side, stays) else home


def _over_ground(shoulder: Shoulder, side: str, points: np.ndarray) -> bool:
    """Whether points of an arm [N, 4, 3] are beside and over the trunk, not under it."""
    low, high = shoulder.middle - shoulder.half, shoulder.middle + shoulder.half
    aside = points[..., 1] * shoulder.sign
    if side == "back":
        return bool(points[..., 0].min() > low[0] - _UNDER_M)
    if side == "belly":
        return bool(points[..., 0].max() < high[0] + _UNDER_M)
    if side == shoulder.side:
        # The arm below lies ahead of the trunk.
        return bool(aside.max() < shoulder.half[1] + 0.05)
    return bool(points[:, 0, 0].min() > -0.02 and aside.min() > -shoulder.half[1] - 0.05)


def _upright(rng: np.random.Generator, body: Body, bent: float) -> Lying:
    """Standing, with bent knees [rad]."""
    legs = np.tile([0.45 * bent, bent, 0.5 * bent, -0.04, 0.1], (2, 1))
    arms = tuple(
        Shoulder(body, side).hang(rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.1)) for side in SIDES
    )
    return Lying("back", legs, (arms[0], arms[1]), np.array([0.05 + 0.2 * bent, 0, 0]), np.zeros(3))


def _flailing(rng: np.random.Generator, body: Body, posture: Lying, way: str) -> Lying:
    """The same with arms that go out to break the fall."""
    arms = []
    for side in SIDES:
        shoulder = Shoulder(body, side)
        ahead = {"ahead": 0.8, "back": 0.3}.get(way, 0.4) + rng.normal(0.0, 0.2)
        aside = rng.uniform(0.1, 0.9)
        target = np.array([ahead, aside * shoulder.sign, rng.uniform(-0.7, 0.3)])
        target *= shoulder.reach_m * rng.uniform(0.7, 0.95) / np.linalg.norm(target)
        arms.append(shoulder.reach(shoulder.place + target, 0.4))
    return replace(posture, arms=(arms[0], arms[1]))


def _at_the_chest(rng: np.random.Generator, body: Body) -> tuple[ArmPose, ArmPose]:
    """Both arms bent, hands before the chest."""
    arms = []
    for side in SIDES:
        shoulder = Shoulder(body, side)
        ahead = shoulder.middle[0] + shoulder.half[0] + rng.uniform(0.06, 0.12)
        place = np.array([ahead, 0.05 * shoulder.sign, rng.uniform(-0.1, 0.1)])
        arms.append(shoulder.reach(place, rng.uniform(-0.2, 0.2)))
    return arms[0], arms[1]


def _set(track: Track, knots: list[float], ways: list[Lying], rng: np.random.Generator) -> None:
    """Moves all but the pelvis through ways to lie."""
    times = track.times
    trunk = keyed(times, knots, np.stack([way.trunk for way in ways]))
    head = keyed(times, knots, np.stack([way.head for way in ways]))
    legs = keyed(times, knots, np.stack([way.legs for way in ways]))
    track.trunk(*trunk.T)
    track.gaze(head[:, 0], head[:, 1], head[:, 2] + 0.05 * noise(rng, times, 0.3))
    for row, side in enumerate(SIDES):
        hip, knee, ankle, abduction, rotation = legs[:, row].T
        track.leg(side, hip, knee, ankle, abduction, rotation)
        set_arm(track, side, knots, [way.arms[row] for way in ways])


def _middle_at(track: Track, places: np.ndarray) -> None:
    """Puts the middle of the trunk at places on the floor [T, 2]."""
    track.root[:, :2] = 0.0
    chest = track.heads()[:, bone("spine_upper"), :2]
    track.root[:, :2] = places - 0.5 * chest


def _feet_at(track: Track) -> None:
    """Keeps the middle between both ankles where it is at first: bodies tip over their feet."""
    track.root[:, :2] = 0.0
    heads = track.heads()
    middle = np.mean([heads[:, bone(f"foot_{side}"), :2] for side in SIDES], axis=0)
    track.root[:, :2] = smoothed(-middle, RATE_HZ, 0.03)
