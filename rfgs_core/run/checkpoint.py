# SPDX-License-Identifier: Apache-2.0
"""Fitted frames of a run on disk: what others read, and what the next frame starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from rfgs_core.arrays import Shape, load_arrays, save_arrays
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.fit.frame import FrameState
from rfgs_core.fit.parameters import GAUSSIAN_SHAPES
from rfgs_core.gaussians import Gaussians
from rfgs_core.gaussians.ply import cloud_of, write_ply
from rfgs_core.model.head import HEAD_SHAPES, HEAD_TYPES, RadioHead
from rfgs_core.radio.levels import decibels
from rfgs_core.run.calibration import calibration_path
from rfgs_core.run.config import HEAD_FILE, REMEDY
from rfgs_core.run.folder import LIMBS_FILE, Run, checkpoint_path
from rfgs_core.run.static import static_ply

_CHECKPOINT: dict[str, Shape] = {
    **GAUSSIAN_SHAPES,
    "power": ("M",),
    "axes_xy": ("body", 2),
    "velocity_xy": ("body", 2),
    "time_s": (),
    "knees_rad": ("body",),
    "track_id": ("M",),
    "next_track": (),
    **{f"head.{name}": shape for name, shape in HEAD_SHAPES.items()},
}

#: Where somebody lies.
_LYING: dict[str, Shape] = {"lying": ("body", 2)}

_CHECKPOINT_TYPES = {
    **dict.fromkeys([*GAUSSIAN_SHAPES, "power"], "f4"),
    **dict.fromkeys(("axes_xy", "velocity_xy", "time_s", "knees_rad", "lying"), "f8"),
    **dict.fromkeys(("track_id", "next_track"), "i8"),
    **{f"head.{name}": kind for name, kind in HEAD_TYPES.items()},
}

#: Velocities are not known in a first frame, and who stands neither lies nor has knees that point
#: anywhere.
_MAY_BE_NAN = ("velocity_xy", "knees_rad", "lying")


def partial_path(run: Run, frame: int) -> Path:
    """State of a frame that is being refined; gone once it is finished."""
    return checkpoint_path(run.path, frame).with_suffix(".partial.npz")


def store_frame(
    run: Run, frame: int, state: FrameState, more: Mapping[str, np.ndarray] | None = None
) -> None:
    """Writes a finished frame; its checkpoint comes last and marks it as done.

    Args:
        run: The run.
        frame: Which frame.
        state: Its Gaussians.
        more: Further arrays beside the PLY, a row per Gaussian.
    """
    power_db = decibels(state.power.numpy()).astype(np.float32)
    write_ply(run.ply_path(frame), cloud_of(state.gaussians, rf_power_db=power_db))
    gamma = state.gamma.detach().numpy().astype(np.complex64)
    save_arrays(
        run.features_path(frame),
        {
            "features": state.gaussians.features.numpy(),
            "gamma": gamma[:, None],
            "rf_power_db": power_db,
            "track_id": state.track_id,
            "body": state.moving.body,
            **(more or {}),
        },
    )
    if not static_ply(run.path).exists():
        write_ply(static_ply(run.path), cloud_of(Gaussians.none()))
    head = state.head.arrays()
    save_arrays(run.path / HEAD_FILE, head)
    arrays = {name: value.numpy() for name, value in state.gaussians.items()}
    arrays |= {"power": state.power.numpy(), "track_id": state.track_id}
    arrays["next_track"] = np.array(state.unused_track)
    tracks = {name: value for name, value in asdict(state.tracks).items() if value is not None}
    arrays |= {name: np.asarray(value) for name, value in tracks.items()}
    arrays |= {f"head.{name}": value for name, value in head.items()}
    save_arrays(checkpoint_path(run.path, frame), arrays)
    partial_path(run, frame).unlink(missing_ok=True)


def is_finished(run: Run, frame: int) -> bool:
    """Whether a frame is fitted and everything that is kept of it is there."""
    kept = [checkpoint_path(run.path, frame), run.ply_path(frame), run.features_path(frame)]
    if run.config.settings.calibrate != "none":
        kept.append(calibration_path(run.path, frame))
    return all(path.exists() for path in (*kept, run.path / HEAD_FILE))


def lost_limbs(run: Run) -> bool:
    """Whether Gaussians of a run are on skins of people whose limbs are no longer there."""
    first = run.features_path(run.frames[0])
    if (run.path / LIMBS_FILE).exists() or not first.exists():
        return False
    bone: dict[str, Shape] = {"bone": ("M",)}
    return "bone" in load_arrays(first, REMEDY, {}, types={"bone": "i8"}, optional=bone)


def finished_frame(run: Run, frame: int) -> FrameState | None:
    """The state of a frame that is already fitted, for the next one to start from."""
    if not is_finished(run, frame):
        return None
    path = checkpoint_path(run.path, frame)
    remedy = "delete it to fit this frame again"
    arrays = load_arrays(
        path, remedy, _CHECKPOINT, _MAY_BE_NAN, types=_CHECKPOINT_TYPES, optional=_LYING
    )
    fields = {name: torch.from_numpy(arrays[name]) for name in GAUSSIAN_SHAPES}
    return FrameState(
        gaussians=Gaussians(**fields),
        power=torch.from_numpy(arrays["power"]),
        head=RadioHead.of_arrays(arrays, "head."),
        tracks=Tracks(
            axes_xy=arrays["axes_xy"],
            velocity_xy=arrays["velocity_xy"],
            time_s=float(arrays["time_s"]),
            knees_rad=arrays["knees_rad"],
            lying=arrays.get("lying"),
        ),
        track_id=arrays["track_id"],
        next_track=int(arrays["next_track"]),
    )
