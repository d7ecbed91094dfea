# SPDX-License-Identifier: Apache-2.0
"""How fast the bodies of a run move, and how many Gaussians they have meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.arrays import load_arrays
from rfgs_core.run.folder import checkpoint_path

_REMEDY = "delete it and run the same `rfgs train` again"
_SHAPES = {"velocity_xy": ("body", 2), "time_s": (), "means": ("M", 3)}


@dataclass(frozen=True)
class Motion:
    """Every frame of a run."""

    time_s: Float64[np.ndarray, "frame"]
    """When [s]."""
    count: Int64[np.ndarray, "frame"]
    """Moving Gaussians."""
    speed_m_s: Float64[np.ndarray, "frame body"]
    """Speed of each body's track since the frame before [m/s]; NaN in the first."""


def read_motion(run: Path, frames: Sequence[int]) -> Motion | None:
    """The motion of a run from its checkpoints; None where they are not all kept.

    Raises:
        RfgsFormatError: A checkpoint is damaged.
    """
    paths = [checkpoint_path(run, frame) for frame in frames]
    if not all(path.exists() for path in paths):
        return None
    rows = [load_arrays(path, _REMEDY, _SHAPES, ("velocity_xy",)) for path in paths]
    return Motion(
        time_s=np.array([float(row["time_s"]) for row in rows]),
        count=np.array([len(row["means"]) for row in rows], dtype=np.int64),
        speed_m_s=np.stack([np.linalg.norm(row["velocity_xy"], axis=1) for row in rows]),
    )


def speeds_between(
    xy: Float64[np.ndarray, "frame body 2"], time_s: Float64[np.ndarray, "frame"]
) -> Float64[np.ndarray, "frame body"]:
    """Speed of places over the ground since the frame before [m/s]; NaN in the first."""
    speed = np.full(xy.shape[:2], np.nan)
    speed[1:] = np.linalg.norm(np.diff(xy, axis=0), axis=2) / np.diff(time_s)[:, None]
    return speed
