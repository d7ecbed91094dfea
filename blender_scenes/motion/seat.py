# SPDX-License-Identifier: GPL-3.0-or-later
"""Sitting down and standing up: the feet stay, the pelvis travels, the trunk leans for balance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.arms import hang_arm, reach, relax_fingers
from blender_scenes.motion.feet import feet_at, solve_leg
from blender_scenes.motion.gait import Gait, facing
from blender_scenes.motion.gestures import minimum_jerk
from blender_scenes.motion.rotations import about_x
from blender_scenes.motion.score import Clip, Figure, Posture, standing_steps
from blender_scenes.motion.skeleton import SIDES, Pose
from blender_scenes.motion.walking import SPINE

#: Forward lean of the trunk halfway down [rad], and backward lean of a seated one.
_BOW, _RECLINE = 0.87, -0.10
#: Knees stand so far ahead of the ankles [m].
_KNEE_AHEAD_M = 0.07
#: Skin within this distance of the pelvis rests on the seat [m].
_BUTTOCKS_M = 0.22


@dataclass(frozen=True)
class Sit:
    """Sits down on a seat right behind the person."""

    seat_m: float = 0.45
    """Height of the seat above the floor under the feet [m]."""
    duration_s: float = 1.7
    """How long it takes [s]."""
    label: str = "sit_down"
    """Name of the action."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "stand":
            raise ValueError(f"expected to sit down from standing, not: {start.kind}")
        way = _Way(figure, start, self.seat_m)
        held = way.pose(1.0, 1.0, 1.0, 0.0)

        def pose(time_s: float) -> Pose:
            t = time_s / self.duration_s
            return way.pose(
                back=minimum_jerk((t - 0.05) / 0.85),
                down=minimum_jerk((t - 0.08) / 0.84),
                settled=minimum_jerk((t - 0.45) / 0.55),
                bow=_bump(t, 0.55),
            )

        return [Clip(self.label, self.duration_s, pose, replace(start, kind="sit", held=held))]


@dataclass(frozen=True)
class Rise:
    """Stands up from where the person sat down."""

    seat_m: float = 0.45
    """Height of the seat, as given to `Sit` [m]."""
    duration_s: float = 1.5
    """How long it takes [s]."""
    label: str = "stand_up"
    """Name of the action."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "sit":
            raise ValueError(f"expected to stand up from sitting, not: {start.kind}")
        end = replace(start, kind="stand", held=None)
        way = _Way(figure, end, self.seat_m)

        def pose(time_s: float) -> Pose:
            t = time_s / self.duration_s
            return way.pose(
                back=1 - minimum_jerk((t - 0.16) / 0.74),
                down=1 - minimum_jerk((t - 0.26) / 0.74),
                settled=1 - minimum_jerk(t / 0.5),
                bow=_bump(t, 0.38),
            )

        return [Clip(self.label, self.duration_s, pose, end)]


def before_seat(
    figure: Figure, seat: tuple[float, float], heading_rad: float, seat_m: float = 0.45
) -> Posture:
    """Where to stand so that `Sit` brings the pelvis over the point `seat` [m].

    Args:
        figure: Who will sit.
        seat: Point of the seat that the pelvis comes to rest above [m].
        heading_rad: Heading of the seated person, counter-clockwise from +x.
        seat_m: Height of the seat [m].
    """
    origin = Posture((0.0, 0.0), heading_rad)
    pelvis = _Way(figure, origin, seat_m).seated
    return replace(origin, place_m=(seat[0] - float(pelvis[0]), seat[1] - float(pelvis[1])))


def seat_contact_m(figure: Figure, pose: Pose) -> float:
    """Height of the lowest point of the buttocks [m], the part that rests on a seat."""
    points = figure.skeleton.touching(pose, "root", "pelvis", "upperleg")
    near = np.linalg.norm(points[:, :2] - pose.root[:2], axis=1) < _BUTTOCKS_M
    return float(points[near, 2].min())


class _Way:
    """Poses between standing at a place and sitting on a seat behind it."""

    def __init__(self, figure: Figure, start: Posture, seat_m: float) -> None:
        self._figure, self._start = figure, start
        self._standing = start.pose(figure)
        steps = standing_steps(figure, start)
        self._feet = feet_at(Gait(), figure.skeleton.legs, steps, steps.last + 2.0)
        self.seated = self._standing.root + 0.0
        # The pelvis sinks until buttocks and thighs touch the seat; legs follow it.
        height = start.floor_m + seat_m
        self.seated[2] = height + 0.1
        for _ in range(3):
            self.seated[:2] = start.place_m - self._back_m() * start.ahead[:2]
            pose = self.pose(1.0, 1.0, 1.0, 0.0)
            # Flesh gives way by a centimetre.
            self.seated[2] += height - 0.01 - seat_contact_m(figure, pose)

    def _back_m(self) -> float:
        """How far behind the ankles the pelvis sits, with the shins nearly upright."""
        legs = self._figure.skeleton.legs
        thigh = float(np.linalg.norm(legs.knee[0] - legs.hip[0]))
        shin = float(np.linalg.norm(legs.ankle[0] - legs.knee[0]))
        knee_m = self._feet.ankle[0, 2] + np.sqrt(shin**2 - _KNEE_AHEAD_M**2)
        rise = knee_m - (self.seated[2] + legs.hip[0, 2] - legs.root[2])
        return float(np.sqrt(max(thigh**2 - rise**2, 0.01))) - _KNEE_AHEAD_M

    def pose(self, back: float, down: float, settled: float, bow: float) -> Pose:
        """The pose on the way.

        Args:
            back: How far the pelvis is back, 0 standing to 1 sitting.
            down: How far it is down.
            settled: How far trunk and hands are where a seated person has them.
            bow: How far the trunk bows, 0 to 1.
        """
        skeleton, start = self._figure.skeleton, self._start
        stand = self._standing.root
        root = stand + back * (self.seated - stand)
        root[2] = stand[2] + down * (self.seated[2] - stand[2])
        lean = settled * _RECLINE + bow * _BOW
        level = facing(start.heading_rad)
        turns = {"root": level @ about_x(0.45 * bow * _BOW - 0.2 * settled)}
        for index, bone in enumerate(SPINE):
            share = (index + 1) / len(SPINE)
            turns[bone] = level @ about_x((0.6 + 0.4 * share) * lean)
        turns["neck01"] = level @ about_x(0.6 * lean)
        turns["head"] = level @ about_x(0.05 + 0.25 * lean)
        for side, name in enumerate(SIDES):
            thigh, shin, _ = solve_leg(skeleton.legs, side, root, turns["root"], self._feet)
            turns[f"upperleg01.{name}"], turns[f"lowerleg01.{name}"] = thigh, shin
            turns[f"foot.{name}"], turns[f"toe1-1.{name}"] = (
                self._feet.foot[side],
                self._feet.toes[side],
            )
            # Arms hang while the trunk bows, so they come forward by themselves.
            hang_arm(turns, skeleton, name, 0.0)
            relax_fingers(turns, skeleton, name)
        made = Pose(root, turns)
        for name in SIDES:
            made = self._hand_to_thigh(made, name, settled)
        return made

    def _hand_to_thigh(self, pose: Pose, side: str, share: float) -> Pose:
        if share <= 0:
            return pose
        skeleton, start = self._figure.skeleton, self._start
        joints = skeleton.joints(pose)
        hip, knee, shoulder, elbow, wrist = (
            joints[skeleton.index[f"{name}.{side}"]]
            for name in ("upperleg01", "lowerleg01", "upperarm01", "lowerarm01", "wrist")
        )
        # The wrist lies on the thigh, the palm reaches towards the knee.
        outward = start.left * (1.0 if side == "L" else -1.0)
        wanted = hip + 0.58 * (knee - hip) + 0.03 * outward + np.array([0.0, 0.0, 0.1])
        hanging = elbow - 0.5 * (shoulder + wrist)
        bent = 0.5 * outward - 0.8 * start.ahead - np.array([0.0, 0.0, 0.2])
        towards = (1 - share) * hanging / np.linalg.norm(hanging) + share * bent
        return reach(skeleton, pose, side, (1 - share) * wrist + share * wanted, towards)


def _bump(share: float, peak: float) -> float:
    """0 at both ends, 1 at `peak`, level at all three."""
    if share < peak:
        return minimum_jerk(share / peak)
    return 1 - minimum_jerk((share - peak) / (1 - peak))
