# SPDX-License-Identifier: Apache-2.0
"""People of a run with their limbs, as they are kept in its folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.articulated import BONES
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.errors import RfgsFormatError
from rfgs_core.fit.frame import OnSkins
from rfgs_core.limbs.propose import Joints
from rfgs_core.limbs.skins import PosedPeople
from rfgs_core.run.folder import LIMBS_FILE
from rfgs_core.settings import TrainConfig

REMEDY = "delete it and run the same `rfgs train` again"
_SHAPES = {
    "frames": ("frame",),
    "axes_xy": ("frame", "body", 2),
    "velocity_xy": ("frame", "body", 2),
    "time_s": ("frame",),
    "joints": ("frame", "body", 17, 3),
    "sigma_m": ("frame", "body", 17),
    "coefficients": ("body", "coefficient"),
    "root": ("frame", "body", 3),
    "turns": ("frame", "body", len(BONES), 3, 3),
}
_TYPES = {name: "f8" for name in _SHAPES} | {"frames": "i8", "turns": "f4"}


@dataclass(frozen=True)
class Limbs:
    """Everybody in every frame of a run."""

    frames: list[int]
    """Frames."""
    tracks: list[Tracks]
    """Where people are in each frame, and how fast."""
    joints: Joints
    """What evidence and the network say, shape (frame, body, 17, ·)."""
    people: PosedPeople
    """Bodies in these poses."""

    def on_skins(self, frame: int, config: TrainConfig) -> OnSkins:
        """Gaussians of a frame, at the same places of the skins as in all others."""
        index = self.frames.index(frame)
        drawn = self.people.gaussians(index, config.num_gaussians, config.seed)
        return OnSkins(drawn.points, drawn.normals, self.tracks[index])

    def of_gaussians(self, frame: int, config: TrainConfig) -> dict[str, np.ndarray]:
        """What else is known of each Gaussian of `on_skins`.

        Returns:
            `bone` that carries it, as in `articulated.BONES`, and `sigma_m`, how far the joint next
            to it is expected to be off [m].
        """
        index = self.frames.index(frame)
        drawn = self.people.gaussians(index, config.num_gaussians, config.seed)
        joints = self.people.joints17()[index]
        away = np.linalg.norm(drawn.points[:, None] - joints[drawn.body], axis=2)
        sigma_m = self.joints.sigma_m[index][drawn.body, away.argmin(axis=1)]
        return {"bone": drawn.bone, "sigma_m": sigma_m.astype(np.float32)}


def store_limbs(run: Path, limbs: Limbs) -> None:
    """Writes them into a run's folder."""
    save_arrays(
        run / LIMBS_FILE,
        {
            "frames": np.array(limbs.frames, dtype=np.int64),
            "axes_xy": np.array([track.axes_xy for track in limbs.tracks]),
            "velocity_xy": np.array([track.velocity_xy for track in limbs.tracks]),
            "time_s": np.array([track.time_s for track in limbs.tracks]),
            "joints": limbs.joints.xyz,
            "sigma_m": limbs.joints.sigma_m,
            "coefficients": limbs.people.coefficients,
            "root": limbs.people.root,
            "turns": limbs.people.turns,
        },
    )


def read_limbs(run: Path) -> Limbs | None:
    """The people of a run; None where their limbs were not told.

    Raises:
        RfgsFormatError: The file is damaged.
    """
    path = run / LIMBS_FILE
    if not path.exists():
        return None
    stored = load_arrays(path, REMEDY, _SHAPES, ("velocity_xy",), types=_TYPES)
    frames = [int(frame) for frame in stored["frames"]]
    if not frames or sorted(set(frames)) != frames or not (stored["sigma_m"] > 0.0).all():
        raise RfgsFormatError(
            f"{path}: expected ascending frames and deviations above zero; {REMEDY}"
        )
    standing: Float64[np.ndarray, "body"] = np.full(stored["axes_xy"].shape[1], np.nan)
    tracks = [
        Tracks(axes, velocity, float(at), standing)
        for axes, velocity, at in zip(
            stored["axes_xy"], stored["velocity_xy"], stored["time_s"], strict=True
        )
    ]
    return Limbs(
        frames,
        tracks,
        Joints(stored["joints"], stored["sigma_m"]),
        PosedPeople(stored["coefficients"], stored["root"], stored["turns"]),
    )
