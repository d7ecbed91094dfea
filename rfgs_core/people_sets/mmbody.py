# SPDX-License-Identifier: Apache-2.0
"""mmBody (Chen et al., ACM MM 2022): point clouds of a 77 GHz imaging radar, and motion capture.

`train/sequence_0/radar/frame_0.npy` and `test/lab1/sequence_0/…` hold rows of x (across), y
(ahead), z (up) [m], velocity, amplitude and power; `mesh/frame_0.npz` holds SMPL-X `joints` in
the radar's own axes. Read after the authors' loader (github.com/Chen3110/mmBody,
`mmbody_dataset.py` and its README). `calib.txt`, which that loader runs as Python, is not read:
nothing here needs the cameras. What is stored of a point's strength is in units that nobody
states, so every point counts alike.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.arrays import load_array, load_arrays
from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.model import Claim, Found, HeardFrame, joints_of

#: Rows of the first 22 joints of SMPL-X; its head is where the skull begins, which is our neck.
SMPLX = {
    "pelvis": 0, "left_hip": 1, "right_hip": 2, "left_knee": 4, "right_knee": 5, "spine": 6,
    "left_ankle": 7, "right_ankle": 8, "thorax": 12, "neck": 15, "left_shoulder": 16,
    "right_shoulder": 17, "left_elbow": 18, "right_elbow": 19, "left_wrist": 20, "right_wrist": 21,
}  # fmt: skip
_REMEDY = "expected mmBody as it is published (sequence_0/radar/frame_0.npy and mesh/frame_0.npz)"
_MOST_BYTES = 2**27


@dataclass(frozen=True)
class MMBody:
    """The set."""

    found: Found

    name = "mmBody"
    claims: tuple[Claim, ...] = ()
    assumptions: tuple[str, ...] = ()

    @staticmethod
    def at(folder: Path) -> MMBody | None:
        """The set in a folder; None if there is none."""
        patterns = ("sequence_*", "train/sequence_*", "test/*/sequence_*", "*/sequence_*")
        parts = {path for pattern in patterns for path in folder.glob(pattern)}
        parts = {path for path in parts if (path / "radar").is_dir() and (path / "mesh").is_dir()}
        return MMBody(Found(folder, tuple(sorted(parts)))) if parts else None

    @cached_property
    def _files(self) -> list[tuple[Path, int]]:
        """Every frame that has points and joints: its sequence and number."""
        found = []
        for part in self.found.parts:
            numbers = [
                int(file.stem.removeprefix("frame_"))
                for file in (part / "radar").glob("frame_*.npy")
                if file.stem.removeprefix("frame_").isdecimal()
            ]
            found += [
                (part, number)
                for number in sorted(numbers)
                if (part / "mesh" / f"frame_{number}.npz").exists()
            ]
        return found

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._files)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame."""
        for part, number in self._files[::every]:
            points = _points(part / "radar" / f"frame_{number}.npy")
            joints = _joints(part / "mesh" / f"frame_{number}.npz")
            yield HeardFrame(points, np.ones(len(points)), joints, None)


def _points(path: Path) -> Float64[np.ndarray, "point 3"]:
    rows = load_array(path, _REMEDY, 2, _MOST_BYTES)
    if rows.shape[1] < 3 or rows.dtype.kind not in "fiu":
        raise RfgsFormatError(f"{path}: expected points (N, 6), found {rows.shape}; {_REMEDY}")
    places = rows[:, :3].astype(np.float64)
    return places[np.isfinite(places).all(axis=1)]


def _joints(path: Path) -> Float64[np.ndarray, "17 3"]:
    stored = load_arrays(path, _REMEDY, {"joints": ("joint", 3)}, seal=False)["joints"].astype(
        np.float64
    )
    if len(stored) <= max(SMPLX.values()):
        raise RfgsFormatError(f"{path}: expected 22 joints or more, found {len(stored)}; {_REMEDY}")
    return joints_of(stored, SMPLX)
