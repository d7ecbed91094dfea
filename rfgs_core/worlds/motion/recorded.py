# SPDX-License-Identifier: Apache-2.0
"""Recorded motions as those of random worlds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.spatial.transform import Rotation, Slerp

from rfgs_core.articulated import BONES, Body, Pose
from rfgs_core.articulated.bones import PARENT_ROWS
from rfgs_core.errors import RfgsError
from rfgs_core.motion_capture import Recording, retarget
from rfgs_core.motion_capture.joints import match_joints
from rfgs_core.worlds.motion.curves import Z, about
from rfgs_core.worlds.motion.motion import RATE_HZ, Motion

#: Name of the family.
RECORDED = "recorded"
#: Most frames and joints of a recording, and how far from one a quaternion's length may be.
_MOST_FRAMES, _MOST_JOINTS, _UNEVEN = 20_000, 200, 0.01
#: Skin stays so far above the floor [m], and lifts take so long either way [s].
_ABOVE_M, _LIFT_S = 0.002, 0.1
#: Digits of what is kept: a tenth of a millimetre, where the file is in metres.
_DIGITS = 5


@dataclass(frozen=True)
class KeptRecording:
    """A recording in plain numbers, to be kept beside the worlds that are made of it."""

    name: str
    """Of its file."""
    up: str
    """Axis that is up, `y` or `z`."""
    joints: tuple[str, ...]
    """Names, parents before children."""
    parents: tuple[int, ...]
    """Index of each joint's parent, −1 for the root."""
    offsets: tuple[tuple[float, float, float], ...]
    """From the parent to each joint at rest."""
    frame_s: float
    """Time from frame to frame [s]."""
    root: tuple[tuple[float, float, float], ...]
    """Position of the root in each frame."""
    quats: tuple[tuple[tuple[float, float, float, float], ...], ...]
    """Rotation of each joint against its parent, w last, by frame."""

    @staticmethod
    def of(name: str, recording: Recording, up: str = "y") -> KeptRecording:
        """Keeps a recording, with no more frames than motions have samples."""
        step = max(1, int(1.0 / (RATE_HZ * recording.frame_s) + 1e-6))
        turns, root = recording.turns[::step], recording.root[::step]
        quats = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat()
        return KeptRecording(
            name, up, recording.joints, recording.parents, _tuples(recording.offsets),
            step * recording.frame_s, _tuples(root), _tuples(quats.reshape(*turns.shape[:2], 4)),
        )  # fmt: skip

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return (len(self.root) - 1) * self.frame_s

    def between(self, start_s: float, end_s: float) -> KeptRecording:
        """The part around some time of it [s], two frames at least."""
        last = len(self.root) - 1
        first = min(max(int(start_s / self.frame_s), 0), last - 1)
        end = min(int(np.ceil(end_s / self.frame_s)) + 1, last)
        part = slice(first, max(end, first + 1) + 1)
        return replace(self, root=self.root[part], quats=self.quats[part])

    def check(self) -> None:
        """Refuses what no person can have done.

        Raises:
            RfgsError: Numbers are missing, are too many, or are no rotations; or joints are not
                those of a person.
        """
        count = len(self.joints)
        shapes = (len(self.parents), len(self.offsets), *{len(row) for row in self.quats})
        if not (0 < count <= _MOST_JOINTS and set(shapes) == {count}):
            raise RfgsError(f"recording {self.name}: expected as many numbers as joints")
        if not (2 <= len(self.root) == len(self.quats) <= _MOST_FRAMES):
            raise RfgsError(
                f"recording {self.name}: {len(self.root)} frames; expected 2 to {_MOST_FRAMES}, "
                "cut it"
            )
        if any(not -1 <= parent < row for row, parent in enumerate(self.parents)):
            raise RfgsError(f"recording {self.name}: expected parents before their children")
        if self.up not in ("y", "z") or not 0.0 < self.frame_s < 10.0:
            raise RfgsError(f"recording {self.name}: expected an axis y or z, and frames in time")
        lengths = np.linalg.norm(np.array(self.quats), axis=-1)
        # What is no number is no rotation either.
        if not (np.abs(lengths - 1.0) < _UNEVEN).all():
            raise RfgsError(f"recording {self.name}: expected rotations as unit quaternions")
        match_joints(self.recording)

    @property
    def recording(self) -> Recording:
        """The recording."""
        quats = np.array(self.quats)
        turns = Rotation.from_quat(quats.reshape(-1, 4)).as_matrix()
        return Recording(
            self.joints, self.parents, np.array(self.offsets),
            turns.reshape(*quats.shape[:2], 3, 3), np.array(self.root), self.frame_s,
        )  # fmt: skip


def recorded_motion(body: Body, kept: KeptRecording) -> Motion:
    """What was recorded, by somebody of ours: from the origin, first towards +x.

    Args:
        body: Who does it.
        kept: The recording.

    Raises:
        RfgsFormatError: Its joints are not those of a person.
    """
    root, turns = retarget(kept.recording, dict(zip(BONES, body.heads, strict=True)), kept.up)
    ahead = turns["pelvis"][0, :, 0]
    back = about(Z, -float(np.arctan2(ahead[1], ahead[0])))
    root = (root - root[0] * [1.0, 1.0, 0.0]) @ back.T
    times = kept.frame_s * np.arange(len(root))
    samples = np.arange(0.0, times[-1], 1.0 / RATE_HZ)
    # Bones that were not recorded follow those that carry them.
    world: list[np.ndarray] = []
    for name, parent in zip(BONES, PARENT_ROWS, strict=True):
        if name in turns:
            between = Slerp(times, Rotation.from_matrix(back @ turns[name]))
            world.append(between(samples).as_matrix())
        else:
            world.append(world[parent])
    whole = np.stack(world, axis=1)
    local = whole.copy()
    local[:, 1:] = np.swapaxes(whole[:, PARENT_ROWS[1:]], -1, -2) @ whole[:, 1:]
    places = np.stack([np.interp(samples, times, root[:, axis]) for axis in range(3)], axis=1)
    places[:, 2] += _lift(body, places, whole)
    rest = np.tile(np.eye(3), (len(BONES), 1, 1))
    return Motion(RECORDED, rest, local, places, np.zeros(len(samples)))


def _lift(body: Body, places: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """How far to lift somebody in each sample [m], smoothly, so that no skin is under the floor.

    Arms and legs of other lengths than the recorded ones would reach through it.
    """
    poses = (Pose(place, turn) for place, turn in zip(places, turns, strict=True))
    lowest = np.array([body.skin(pose)[:, 2].min() for pose in poses])
    width = 2 * int(_LIFT_S * RATE_HZ) + 1
    wanted = maximum_filter1d(np.maximum(_ABOVE_M - lowest, 0.0), width, mode="nearest")
    # A mean of maxima around is nowhere below what is wanted there.
    return uniform_filter1d(wanted, width, mode="nearest")


def _tuples(values: np.ndarray) -> tuple:
    """Nested tuples of numbers, rounded."""
    rows = np.round(values, _DIGITS).tolist()

    def frozen(row: Sequence) -> tuple:
        return tuple(frozen(item) if isinstance(item, list) else item for item in row)

    return frozen(rows)
