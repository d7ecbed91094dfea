# SPDX-License-Identifier: GPL-3.0-or-later
"""Falling over: the body tips about its feet like a pendulum while the joints give way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.gait import facing
from blender_scenes.motion.gestures import minimum_jerk
from blender_scenes.motion.rotations import about, about_x, about_y, smoothstep
from blender_scenes.motion.score import Clip, Figure, Posture
from blender_scenes.motion.skeleton import Pose, Skeleton

_GRAVITY_M_S2 = 9.81
_STEP_S = 0.002
#: Share of the stature at which the mass of a body that gives way turns about the feet.
_PENDULUM = 0.62
#: The push that starts a fall: peak of its angular acceleration [rad/s²] and its duration [s].
_PUSH_RAD_S2, _PUSH_S = 9.0, 0.30
#: Limbs come to rest this long after the trunk has reached the floor [s].
_SETTLE_S = 0.55

_DIRECTIONS = {"back": np.pi, "left": 0.5 * np.pi, "right": -0.5 * np.pi, "front": 0.0}

#: Bends of bones against their parents [rad] about the person's own axes: (forward,
#: outwards). Halfway through the fall, and lying; `under` and `over` are the sides of a person
#: who lies on one.
_Bends = dict[str, tuple[float, float]]
_GIVING_WAY: _Bends = {
    "upperleg01": (-0.85, 0.0), "lowerleg01": (1.25, 0.0), "foot": (-0.35, 0.0),
    "spine05": (0.10, 0.0), "spine03": (0.18, 0.0), "spine01": (0.18, 0.0), "neck01": (0.20, 0.0),
    "head": (0.15, 0.0), "upperarm01": (-0.75, 0.45), "lowerarm01": (-0.55, 0.0),
}  # fmt: skip
_LYING: dict[str, _Bends] = {
    "back": {
        "upperleg01": (-0.10, 0.10), "lowerleg01": (0.30, 0.0), "foot": (0.25, 0.0),
        "neck01": (0.08, 0.0), "head": (0.10, 0.0), "upperarm01": (0.10, 0.10),
        "lowerarm01": (0.85, 0.0),
    },
    "front": {
        "upperleg01": (-0.05, 0.12), "lowerleg01": (0.20, 0.0), "foot": (0.65, 0.0),
        "spine03": (-0.05, 0.0), "neck01": (-0.15, 0.0), "head": (-0.20, 0.0),
        "upperarm01": (0.0, 0.9), "lowerarm01": (0.97, 1.6),
    },
    "side": {
        "upperleg01.under": (-0.55, 0.0), "upperleg01.over": (-0.95, -0.45),
        "lowerleg01.under": (0.85, 0.0), "lowerleg01.over": (1.25, 0.0), "foot": (0.15, 0.0),
        "spine05": (0.08, 0.0), "spine03": (0.14, -0.08), "spine01": (0.12, 0.0),
        "neck01": (0.15, -0.22), "head": (0.08, -0.18), "upperarm01.under": (-1.25, -1.60),
        "upperarm01.over": (-1.00, -2.05), "lowerarm01.under": (0.55, -0.25),
        "lowerarm01.over": (0.35, 0.0),
    },
}  # fmt: skip
#: An arm under the body gives way instead of propping it up.
_GIVING_WAY_ASIDE: _Bends = {
    **_GIVING_WAY,
    "upperarm01.under": (-1.10, -1.00),
    "upperarm01.over": (-0.70, 0.15),
    "lowerarm01.under": (0.30, 0.0),
    "lowerarm01.over": (-0.40, 0.0),
}


@dataclass(frozen=True)
class Fall:
    """Falls over from standing and stays lying; the floor must be free for a body's length.

    The tilt follows the pendulum θ'' = (g/l) sin θ after a short push, so a fall takes about
    as long as real ones, 0.8 to 1 s.
    """

    direction: str = "back"
    """`back`, `front`, `left` or `right`, as the person sees it."""
    label: str = "fall"
    """Name of the action."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "stand":
            raise ValueError(f"expected to fall from standing, not: {start.kind}")
        if self.direction not in _DIRECTIONS:
            raise ValueError(f"expected a fall to {', '.join(_DIRECTIONS)}, got {self.direction!r}")
        tumble = _Tumble(figure.skeleton, start.pose(figure), start, self.direction)
        end = replace(start, kind="lie", held=tumble.pose(tumble.duration_s))
        return [Clip(self.label, tumble.duration_s, tumble.pose, end)]


def tilt_over_time(length_m: float) -> np.ndarray:
    """Tilt [rad] every 2 ms of a pendulum that is pushed over, until it lies at π/2."""
    tilt, rate, out = 0.0, 0.0, [0.0]
    while tilt < 0.5 * np.pi:
        time_s = len(out) * _STEP_S
        push = _PUSH_RAD_S2 * np.sin(np.pi * time_s / _PUSH_S) ** 2 if time_s < _PUSH_S else 0.0
        rate += (_GRAVITY_M_S2 / length_m * np.sin(tilt) + push) * _STEP_S
        tilt += rate * _STEP_S
        out.append(min(tilt, 0.5 * np.pi))
    return np.array(out)


class _Tumble:
    """The poses of one fall."""

    def __init__(self, skeleton: Skeleton, rest: Pose, start: Posture, direction: str) -> None:
        self._skeleton, self._rest, self._start = skeleton, rest, start
        towards = start.heading_rad + _DIRECTIONS[direction]
        self._axis = np.array([-np.sin(towards), np.cos(towards), 0.0])
        aside = direction in ("left", "right")
        under = {"left": "L", "right": "R"}.get(direction, "")
        halfway = _GIVING_WAY_ASIDE if aside else _GIVING_WAY
        lying = _LYING["side" if aside else direction]
        self._poses = [
            skeleton.locals(rest),
            skeleton.locals(self._bent(halfway, under)),
            skeleton.locals(self._bent(lying, under)),
        ]
        stature_m = float(skeleton.surface.points[:, 2].max())
        self._tilt = tilt_over_time(_PENDULUM * stature_m)
        self._feet = self._feet_of(rest)
        self._lift_m = float(rest.root[2] - self._grounded(rest).root[2])

    @property
    def impact_s(self) -> float:
        """When the trunk reaches the floor [s]."""
        return _STEP_S * (len(self._tilt) - 1)

    @property
    def duration_s(self) -> float:
        """How long it takes until all limbs rest [s]."""
        return self.impact_s + _SETTLE_S

    def pose(self, time_s: float) -> Pose:
        """The pose at a time from 0 to `duration_s`."""
        skeleton = self._skeleton
        tilt = float(np.interp(time_s / _STEP_S, np.arange(len(self._tilt)), self._tilt))
        give = smoothstep(tilt / 0.9)
        settle = minimum_jerk(
            (time_s - 0.55 * self.impact_s) / (self.duration_s - 0.55 * self.impact_s)
        )
        first, bent, lying = (skeleton.posed(self._rest.root, local) for local in self._poses)
        made = skeleton.blend(skeleton.blend(first, bent, give), lying, settle)
        over = about(self._axis, tilt)
        made = Pose(made.root, {name: over @ turn for name, turn in made.turns.items()})
        made = self._grounded(made)
        # Standing soles press into the floor by a few millimetres that a lying body does not.
        fade = 1 - smoothstep(time_s / (0.5 * self.impact_s))
        return replace(made, root=made.root + np.array([0.0, 0.0, fade * self._lift_m]))

    def _bent(self, bends: _Bends, under: str) -> Pose:
        """Upright, with bones bent against their parents; `under` is the side lain on."""
        level = facing(self._start.heading_rad)
        turns: dict[str, np.ndarray] = {}
        for index, name in enumerate(self._skeleton.bones):
            parent = self._skeleton.parents[index]
            above = turns[self._skeleton.bones[parent]] if parent >= 0 else level
            plain, _, side = name.partition(".")
            role = f"{plain}.{'under' if side == under else 'over'}"
            forward, outward = bends.get(role, bends.get(plain, (0.0, 0.0)))
            to_left = -outward if (side or under) == "R" else outward
            turns[name] = above @ about_y(-to_left) @ about_x(forward)
        return Pose(self._rest.root, turns)

    def _feet_of(self, pose: Pose) -> np.ndarray:
        joints = self._skeleton.joints(pose)
        return np.mean([joints[self._skeleton.index[f"foot.{side}"]] for side in "LR"], axis=0)

    def _grounded(self, pose: Pose) -> Pose:
        """The same pose where the feet stay in place and the lowest point touches the floor."""
        low = float(self._skeleton.touching(pose)[:, 2].min())
        shift = self._feet - self._feet_of(pose)
        shift[2] = self._start.floor_m - low
        return replace(pose, root=pose.root + shift)
