# SPDX-License-Identifier: Apache-2.0
"""The frames of a run as a viewer needs them: those that are fitted by now, read once."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Float64
from tqdm import tqdm

from rfgs_core.arrays import load_arrays
from rfgs_core.errors import RfgsError
from rfgs_core.render.view import fitted_shader
from rfgs_core.run import Run
from rfgs_core.run.config import HEAD_FILE
from rfgs_core.run.limbs import read_limbs
from rfgs_core.skeleton import JOINTS, PARENTS
from rfgs_core.view.frame import ShownFrame, load_frame

#: Frames kept in memory, and frames that scales are made for.
_KEPT = 8
#: A progress bar is shown for what takes longer [s].
_PATIENCE_S = 2.0
#: Shares of the Gaussians between which people are sought.
_MIDDLE = (5.0, 95.0)


def finished_frames(run: Run) -> list[int]:
    """Frames of a run that have been fitted; a run in training has some of them.

    Raises:
        RfgsError: There is none yet.
    """

    def fitted(frame: int) -> bool:
        # Features and the head of reflectivities are written after the Gaussians.
        kept = (run.ply_path(frame), run.features_path(frame), run.path / HEAD_FILE)
        return all(file.is_file() for file in kept)

    frames = list(filter(fitted, run.frames))
    if not frames:
        raise RfgsError(f"{run.path}: no frame has been fitted yet; `rfgs train` goes on with it")
    return frames


class Frames:
    """Fitted frames of a run."""

    def __init__(self, run: Run) -> None:
        """Looks which frames there are.

        Raises:
            RfgsError: There is none yet.
        """
        self._run = run
        self.numbers = finished_frames(run)
        """Blender frame numbers, ascending."""
        self._bones = fitted_bones(run.path)
        self.read = lru_cache(_KEPT)(self._load)
        """Reads a frame by its number, or gives what was read of it."""

    @property
    def growing(self) -> bool:
        """Whether a training has not finished all frames yet."""
        return len(self.numbers) < len(self._run.frames)

    @property
    def has_skeletons(self) -> bool:
        """Whether skeletons have been fitted."""
        return bool(self._bones)

    def bones(self, frame: int) -> Float32[np.ndarray, "bone 2 3"] | None:
        """Fitted bones of a frame [m], if any."""
        return self._bones.get(frame)

    def grow(self) -> bool:
        """Looks again; whether frames were finished meanwhile."""
        before = len(self.numbers)
        self.numbers = finished_frames(self._run)
        return len(self.numbers) > before

    def samples(self) -> list[ShownFrame]:
        """Some frames, spread over the run."""
        chosen = np.linspace(0, len(self.numbers) - 1, min(len(self.numbers), _KEPT))
        bar = tqdm(chosen, desc="read", unit="frame", delay=_PATIENCE_S, leave=False)
        return [self.read(self.numbers[round(index)]) for index in bar]

    def _load(self, frame: int) -> ShownFrame:
        return load_frame(self._run, frame, fitted_shader(self._run))


def where_people_are(
    samples: list[ShownFrame], bounds_m: Float[np.ndarray, "2 3"]
) -> Float[np.ndarray, "2 3"]:
    """Lowest and highest corner of where most moving Gaussians of some frames are [m].

    Args:
        samples: The frames.
        bounds_m: The scene's own corners, for frames without moving Gaussians.
    """
    means = np.concatenate([frame.means[frame.static :] for frame in samples])
    return np.percentile(means, _MIDDLE, axis=0) if len(means) else np.asarray(bounds_m)


#: What `rfgs pose` writes into a run.
POSE_FILE = "pose.npz"
_REMEDY = "run `rfgs pose` again"
_SHAPES = {
    "frames": ("frame",),
    "time_s": ("frame",),
    "centroid": ("frame", "body", 3),
    "joints": ("frame", "body", len(JOINTS), 3),
}
_TYPES = {"frames": "i8", "time_s": "f8", "centroid": "f8", "joints": "f8"}


def fitted_bones(run: Path) -> dict[int, Float32[np.ndarray, "bone 2 3"]]:
    """Bones of all people by frame, from each joint's parent to it [m]; empty without a fit.

    Raises:
        RfgsFormatError: The file is damaged.
    """
    frames, joints = _joints(run)
    child = np.array([index for index, parent in enumerate(PARENTS) if parent >= 0])
    parent = np.array(PARENTS)[child]
    bones = np.stack([joints[:, :, parent], joints[:, :, child]], axis=3)
    return {
        frame: rows.reshape(-1, 2, 3).astype(np.float32)
        for frame, rows in zip(frames, bones, strict=True)
    }


def _joints(run: Path) -> tuple[list[int], Float64[np.ndarray, "frame body 17 3"]]:
    """Frames, and everybody's joints in them [m]."""
    limbs = read_limbs(run)
    if limbs is not None:
        return limbs.frames, limbs.people.joints17()
    file = run / POSE_FILE
    if not file.is_file():
        return [], np.zeros((0, 0, len(JOINTS), 3))
    arrays = load_arrays(file, _REMEDY, _SHAPES, types=_TYPES)
    return [int(frame) for frame in arrays["frames"]], arrays["joints"]
