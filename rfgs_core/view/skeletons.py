# SPDX-License-Identifier: Apache-2.0
"""Skeletons of a run's people, where training told their limbs or `rfgs pose` has fitted them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64

from rfgs_core.arrays import load_arrays
from rfgs_core.run.limbs import read_limbs
from rfgs_core.skeleton import JOINTS, PARENTS

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

    Args:
        run: Folder of the run.

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
