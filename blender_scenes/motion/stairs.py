# SPDX-License-Identifier: GPL-3.0-or-later
"""Climbing and coming down steps: one foot on every tread."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.gait import Gait
from blender_scenes.motion.going import plan_steps, walk_clip
from blender_scenes.motion.path import RoundedPath
from blender_scenes.motion.score import Clip, Figure, Posture

#: Shoes keep this far from risers [m].
_CLEAR_M = 0.025


@dataclass(frozen=True)
class Climb:
    """Goes up or down straight stairs ahead, from standing to standing."""

    count: int
    """Number of risers."""
    rise_m: float = 0.17
    """Height of each riser [m]; negative goes down."""
    tread_m: float = 0.29
    """Depth of each tread [m]."""
    to_first_m: float = 0.32
    """From the ankles to the first edge [m]."""
    step_s: float = 0.68
    """Time of each step [s]."""
    label: str = ""
    """Name of the action; by default `climb` or `descend`."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "stand":
            raise ValueError(f"expected to climb from standing, not: {start.kind}")
        legs, manner = figure.skeleton.legs, figure.manner
        base = Gait.for_speed(0.75 * float(legs.hip[0, 2]), legs, manner)
        gait = replace(
            base,
            step_m=self.tread_m,
            step_s=self.step_s / manner.cadence,
            flat_from=0.04,
            toe_off_rad=0.45 if self.rise_m > 0 else 0.70,
            lift_m=0.06,
            bob_m=0.0,
            lean_rad=0.16 if self.rise_m > 0 else 0.03,
            pelvis_yaw_rad=0.04,
            arm_swing=0.4 * manner.arm_swing,
        )
        places = self.to_first_m + self._ankle_m(figure) + self.tread_m * np.arange(self.count)
        along = np.concatenate([[0.0, 0.0], places, [places[-1]]])
        levels = self.rise_m * np.concatenate([[0, 0], np.arange(1, self.count + 1), [self.count]])
        end = np.array(start.place_m) + 2 * along[-1] * start.ahead[:2]
        steps = plan_steps(
            gait,
            RoundedPath([start.place_m, (float(end[0]), float(end[1]))]),
            along,
            np.zeros(len(along)),
            start.floor_m + levels,
            flat=True,
        )
        label = self.label or ("climb" if self.rise_m > 0 else "descend")
        return [walk_clip(figure, gait, steps, label)]

    def _ankle_m(self, figure: Figure) -> float:
        """How far beyond the front edge of a tread the ankle stands [m].

        Upwards the toes end short of the next riser and the heel may stand free; downwards the
        heel keeps clear of the riser behind and the toes may.
        """
        skeleton = figure.skeleton
        shoe = [bone.startswith(("foot", "toe")) for bone in skeleton.bones]
        points = skeleton.surface.points[np.array(shoe)[skeleton.surface.bone]]
        ahead = skeleton.legs.ankle[0, 1] - points[:, 1]
        if self.rise_m > 0:
            return self.tread_m - _CLEAR_M - float(ahead.max())
        return _CLEAR_M - float(ahead.min())
