# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays motion capture on our people."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.motion.gait import facing
from blender_scenes.motion.gestures import minimum_jerk
from blender_scenes.motion.rotations import about_z
from blender_scenes.motion.score import Clip, Figure, Posture
from blender_scenes.motion.skeleton import Pose, Skeleton
from blender_scenes.people.bones import RECORDED, anny_name
from rfgs_core.motion_capture import Recording, retarget

#: From where our people look at rest, -y, to where recorded ones look, x.
_AHEAD = about_z(0.5 * np.pi)


def poses_of(recording: Recording, skeleton: Skeleton, up: str = "y") -> list[Pose]:
    """One pose per recorded frame, for a body of other proportions; see `retarget`."""
    known = {bone: anny_name(bone) for bone in RECORDED if anny_name(bone) in skeleton.index}
    heads = {name: _AHEAD @ skeleton.head(ours) for name, ours in known.items()}
    root, turns = retarget(recording, heads, up)
    back = {known[name]: _AHEAD.T @ turn @ _AHEAD for name, turn in turns.items()}
    return [
        Pose(place, {bone: turn[frame] for bone, turn in back.items()})
        for frame, place in enumerate(root @ _AHEAD)
    ]


@dataclass(frozen=True)
class Recorded:
    """Plays a recording from where the person stands, and ends in standing.

    The recording is turned and shifted so that it sets off from the person's place and heading;
    at both ends it is blended with standing.
    """

    recording: Recording
    """What was read."""
    label: str
    """Name of the action."""
    up: str = "y"
    """Axis that is up in the file, `y` or `z`."""
    blend_s: float = 0.4
    """Duration of the blends [s]."""

    def clips(self, figure: Figure, start: Posture) -> list[Clip]:
        """See `Piece`."""
        if start.kind != "stand":
            raise ValueError(f"expected to play {self.label} from standing, not: {start.kind}")
        poses = poses_of(self.recording, figure.skeleton, self.up)
        shift = about_z(start.heading_rad - _heading(poses[0]))
        origin = poses[0].root * [1.0, 1.0, 0.0]
        place = np.array([*start.place_m, start.floor_m])
        poses = [
            Pose(
                place + shift @ (pose.root - origin),
                {name: shift @ turn for name, turn in pose.turns.items()},
            )
            for pose in poses
        ]
        last = poses[-1]
        end = replace(
            start, place_m=(float(last.root[0]), float(last.root[1])), heading_rad=_heading(last)
        )
        first_rest, last_rest = start.pose(figure), end.pose(figure)
        duration_s = self.recording.frame_s * (len(poses) - 1)

        def pose(time_s: float) -> Pose:
            index = min(time_s / self.recording.frame_s, len(poses) - 1.0)
            low = min(int(index), max(len(poses) - 2, 0))
            high = min(low + 1, len(poses) - 1)
            made = figure.skeleton.blend(poses[low], poses[high], index - low)
            into = minimum_jerk(time_s / self.blend_s)
            out = minimum_jerk((duration_s - time_s) / self.blend_s)
            if into < 1:
                made = figure.skeleton.blend(first_rest, made, into)
            return figure.skeleton.blend(last_rest, made, out) if out < 1 else made

        return [Clip(self.label, duration_s, pose, end)]


def _heading(pose: Pose) -> float:
    """Heading of the pelvis, counter-clockwise from +x [rad]."""
    ahead = pose.turns["root"] @ facing(-0.5 * np.pi) @ np.array([0.0, -1.0, 0.0])
    return float(np.arctan2(ahead[1], ahead[0]))
