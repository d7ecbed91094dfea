# SPDX-License-Identifier: Apache-2.0
"""MM-Fi (Yang et al., NeurIPS 2023, arXiv 2305.10345): point clouds of a 60 GHz radar, 17 joints.

`E01/S01/A01/mmwave/frame001.bin` holds rows of five float64: ahead, across, up, and two values
of which published loaders disagree what they mean (so every point counts alike here);
`ground_truth.npy` holds joints (297, 17, 3) in the axes of a camera. Read after the set's own
toolbox (github.com/ybhbingo/MMFi_dataset, `mmfi.py`). Joints are in the order of Human3.6M, which
is ours; one loader has left and right the other way round, so the table gives both.

No file says which way the axes point: joints are turned so that heads are above ankles, points so
that they lie nearest to the joints, both without mirrors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial import KDTree

from rfgs_core.arrays import load_array
from rfgs_core.capture.file_bytes import read_head
from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.model import Claim, Found, HeardFrame
from rfgs_core.skeleton import JOINTS

#: Numbers of a point, and bytes of one.
_COLUMNS, _POINT_BYTES = 5, 40
#: A radar of this kind tells some hundred points; more than this is no frame of it.
_MOST_POINTS = 100_000
#: A frame holds few points: those of so many frames before and after count as well.
_BESIDE = 2
#: Frames that tell which way up the points are.
_ASKED = 60
_REMEDY = "expected MM-Fi as its toolbox lays it out (E01/S01/A01/…)"


@dataclass(frozen=True)
class MMFi:
    """The set."""

    found: Found

    name = "MM-Fi"
    claims: tuple[Claim, ...] = ()
    assumptions: tuple[str, ...] = (
        "heads are above ankles, and points lie where they are nearest to joints",
    )

    @staticmethod
    def at(folder: Path) -> MMFi | None:
        """The set in a folder; None if there is none."""
        parts = [path.parent for path in sorted(folder.glob("E*/S*/A*/ground_truth.npy"))]
        parts = [part for part in parts if (part / "mmwave").is_dir()]
        return MMFi(Found(folder, tuple(parts))) if parts else None

    @cached_property
    def _files(self) -> list[tuple[Path, int]]:
        """Every frame: its sequence and number from zero."""
        return [
            (part, int(file.stem.removeprefix("frame")) - 1)
            for part in self.found.parts
            for file in sorted((part / "mmwave").glob("frame[0-9]*.bin"))
            if file.stem.removeprefix("frame").isdecimal()
        ]

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._files)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame."""
        up = self._up(self._files[:: max(every, len(self._files) // _ASKED, 1)])
        for points, joints in self._raw(self._files[::every]):
            heard = _turned(points, up)
            yield HeardFrame(heard, np.ones(len(heard)), joints, None)

    def _raw(
        self, files: list[tuple[Path, int]]
    ) -> Iterator[tuple[Float64[np.ndarray, "point 3"], Float64[np.ndarray, "17 3"]]]:
        """Points as they are stored, and joints the right way up."""
        truth: tuple[Path | None, np.ndarray] = (None, np.zeros((0, len(JOINTS), 3)))
        for part, number in files:
            if truth[0] != part:
                truth = part, _upright(_truth(part / "ground_truth.npy"))
            if 0 <= number < len(truth[1]):
                yield _cloud(part / "mmwave", number), truth[1][number]

    def _up(self, files: list[tuple[Path, int]]) -> float:
        """1 if the third column points up, else -1."""
        away = {1.0: 0.0, -1.0: 0.0}
        for points, joints in self._raw(files):
            if len(points):
                for up in away:
                    away[up] += float(KDTree(joints).query(_turned(points, up))[0].mean())
        return min(away, key=lambda up: away[up])


def _cloud(folder: Path, number: int) -> Float64[np.ndarray, "point 3"]:
    """Points of a frame and of those beside it that there are."""
    beside = range(number - _BESIDE, number + _BESIDE + 1)
    files = [folder / f"frame{k + 1:03d}.bin" for k in beside]
    own = files[_BESIDE]
    return np.concatenate([_points(file) for file in files if file == own or file.is_file()])


def _points(path: Path) -> Float64[np.ndarray, "point 3"]:
    if path.exists() and not path.is_file():
        raise RfgsFormatError(f"{path}: expected a file with points, found none; {_REMEDY}")
    read_head(path)
    size = path.stat().st_size
    if size % _POINT_BYTES or size > _MOST_POINTS * _POINT_BYTES:
        raise RfgsFormatError(
            f"{path}: {size} bytes are no points of {_POINT_BYTES} bytes each; {_REMEDY}"
        )
    rows = np.frombuffer(path.read_bytes(), "<f8").reshape(-1, _COLUMNS)[:, :3]
    return rows[np.isfinite(rows).all(axis=1)]


def _truth(path: Path) -> Float64[np.ndarray, "frame 17 3"]:
    joints = load_array(path, _REMEDY, 3).astype(np.float64)
    if joints.shape[1:] != (len(JOINTS), 3) or not np.isfinite(joints).all():
        raise RfgsFormatError(
            f"{path}: expected finite joints (frame, 17, 3), found {joints.shape}; {_REMEDY}"
        )
    return joints


def _upright(joints: Float64[np.ndarray, "frame 17 3"]) -> Float64[np.ndarray, "frame 17 3"]:
    """Camera axes (x, y, ahead) with y up or down as x to the right, ahead, z up."""
    head, ankle = JOINTS.index("head"), JOINTS.index("left_ankle")
    side = 1.0 if np.median(joints[:, head, 1] - joints[:, ankle, 1]) < 0.0 else -1.0
    x, y, ahead = np.moveaxis(joints, -1, 0)
    return np.stack([side * x, ahead, -side * y], axis=-1)


def _turned(points: Float64[np.ndarray, "point 3"], up: float) -> Float64[np.ndarray, "point 3"]:
    """Ahead, across, up or down as x to the right, y ahead, z up."""
    ahead, across, above = points.T
    return np.stack([-up * across, ahead, up * above], axis=-1)
