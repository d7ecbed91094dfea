# SPDX-License-Identifier: Apache-2.0
"""RT-Pose (Ho et al., ECCV 2024, arXiv 2407.13930): cubes of a 77 GHz cascade radar, 15 joints.

`Train.json` and `Test.json` list joints [m] by sequence and frame, and the radar's frame that
belongs to each; `file_meta.txt` lists folders by sequence where they are not called like it. A cube
has the axes Doppler, up, across, ahead (64, 32, 128, 256), as `DZYX_npy_f16/000012.npy` of the
authors' loader or `radar/npy_DZYX_complex/000012.npy` of their processing. Cells start at −5.8,
−10.05 and 0 m and are 0.3625, 0.157 and 0.0453 m long. Joints are in the radar's axes and in the
order that a configuration names. Read after github.com/ipl-uw/RT-POSE
(`cruw_pose.py`, `pose.py`, `configs/cruw_pose/hr3d.py`) and the processing in a fork of it
(wshanmu/RT-POSE, `4Dradar2xyz.py`).

That y points left is nowhere said: it follows from x ahead and z up where axes are right-handed.
Frames of more than one person are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from rfgs_core.arrays import load_array
from rfgs_core.capture.file_bytes import read_bytes
from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.model import Claim, Found, HeardFrame, joints_of, strongest_cells
from rfgs_core.records import read_record

#: Cells of a cube along z, y and x; Dopplers at least, so that some of what moves is left, and at
#: most.
_CELLS, _DOPPLERS = (32, 128, 256), (4, 64)
#: Where cells start, and how long they are [m], along z, y and x.
_START_M = np.array([-5.8, -10.05, 0.0])
_STEP_M = np.array([11.6 / 32, 20.1 / 128, 11.6 / 256])
#: Where people are, by the authors' configuration [m], along z, y and x.
_LOW_M, _HIGH_M = np.array([-1.0875, -5.025, 0.7703]), np.array([4.7125, 5.025, 8.0203])
_LABELS = ("Train.json", "Test.json")
#: Rows of the 15 joints.
_ORDER = {
    "pelvis": 0, "right_hip": 1, "right_knee": 2, "right_ankle": 3, "left_hip": 4, "left_knee": 5,
    "left_ankle": 6, "thorax": 7, "head": 8, "left_shoulder": 9, "left_elbow": 10, "left_wrist": 11,
    "right_shoulder": 12, "right_elbow": 13, "right_wrist": 14,
}  # fmt: skip
_REMEDY = "expected RT-Pose as its loader reads it (Train.json, SEQUENCE/DZYX_npy_f16/000000.npy)"
_MOST_BYTES = 2**29
#: Names of sequences and frames; nothing else becomes part of a path.
_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True)
class _Person:
    """One person in one frame."""

    Radar_frameID: int | str
    pose: list[list[float]] = field(default_factory=list)


class _Frame(NamedTuple):
    """A frame that can be read."""

    cube: Path
    joints: Float64[np.ndarray, "17 3"]


@dataclass(frozen=True)
class RTPose:
    """The set."""

    found: Found

    name = "RT-Pose"
    claims: tuple[Claim, ...] = (
        Claim(
            "9.91 cm mean joint error, HRRadarPose, trained on RT-Pose",
            "its abstract, arXiv 2407.13930, read 2026-11-25",
        ),
    )
    assumptions: tuple[str, ...] = (
        "y points left (right-handed axes)",
        "the strongest Doppler and its neighbours are what stands still",
    )

    @staticmethod
    def at(folder: Path) -> RTPose | None:
        """The set in a folder; None if there is none."""
        labels = tuple(folder / name for name in _LABELS if (folder / name).is_file())
        return RTPose(Found(folder, labels)) if labels else None

    @cached_property
    def _files(self) -> list[_Frame]:
        """Every frame of one person whose cube is there."""
        names, found = _folders(self.found.folder / "file_meta.txt"), []
        for labels in self.found.parts:
            listed = read_record(labels, dict[str, dict[str, list[_Person]]], _REMEDY)
            for sequence, frames in listed.items():
                homes = self._homes(names.get(sequence, sequence))
                for people in frames.values() if homes else ():
                    cube = _cube(homes, people)
                    if cube is not None:
                        found.append(_Frame(cube, _joints(labels, sequence, people[0].pose)))
        return found

    def _homes(self, sequence: str) -> list[Path]:
        """Folders of a sequence's cubes."""
        if not _NAME.fullmatch(sequence):
            return []
        root = self.found.folder
        both = [root / sequence, root / "sequences" / sequence]
        inside = ("DZYX_npy_f16", "radar/npy_DZYX_complex")
        return [path / name for path in both for name in inside if (path / name).is_dir()]

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._files)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame."""
        for frame in self._files[::every]:
            points, amplitude = _strongest(_power(frame.cube))
            yield HeardFrame(points, amplitude, frame.joints, None)


def _folders(path: Path) -> dict[str, str]:
    """Names of folders by sequence, as far as there is a list."""
    if not path.is_file():
        return {}
    lines = read_bytes(path).decode("utf-8", "replace").splitlines()
    rows = [line.split(",") for line in lines if line.strip()]
    if not all(len(row) == 2 for row in rows):
        raise RfgsFormatError(f"{path}: expected lines of a sequence and its folder; {_REMEDY}")
    return {sequence.strip(): name.strip() for sequence, name in rows}


def _cube(homes: list[Path], people: list[_Person]) -> Path | None:
    if len(people) != 1 or not people[0].pose:
        return None
    number = str(people[0].Radar_frameID)
    if not _NAME.fullmatch(number):
        return None
    tried = [home / f"{name}.npy" for home in homes for name in (number, number.zfill(6))]
    return next((path for path in tried if path.is_file()), None)


def _joints(labels: Path, sequence: str, pose: list[list[float]]) -> Float64[np.ndarray, "17 3"]:
    if len(pose) != len(_ORDER) or any(len(row) != 3 for row in pose):
        raise RfgsFormatError(
            f"{labels}, sequence {sequence[:40]}: expected 15 joints of 3 numbers; {_REMEDY}"
        )
    return joints_of(_ours(np.array(pose, np.float64)), _ORDER)


def _ours(xyz: Float64[np.ndarray, "point 3"]) -> Float64[np.ndarray, "point 3"]:
    """Ahead, left, up as right, ahead, up."""
    ahead, left, up = xyz.T
    return np.stack([-left, ahead, up], axis=-1)


def _power(path: Path) -> Float64[np.ndarray, "z y x"]:
    """Power of what moves, over the cells."""
    cube = load_array(path, _REMEDY, 4, _MOST_BYTES)
    if cube.shape[1:] != _CELLS or not _DOPPLERS[0] <= len(cube) <= _DOPPLERS[1]:
        raise RfgsFormatError(
            f"{path}: expected a cube (64, 32, 128, 256), found {cube.shape}; {_REMEDY}"
        )
    still = int(np.argmax([_squared(part).sum() for part in cube]))
    power, count = np.zeros(_CELLS), len(cube)
    for index, part in enumerate(cube):
        if 1 < (index - still) % count < count - 1:
            power += _squared(part)
    return power


def _squared(part: np.ndarray) -> Float64[np.ndarray, "z y x"]:
    power = np.abs(part.astype(np.complex128 if part.dtype.kind == "c" else np.float64)) ** 2
    return np.where(np.isfinite(power), power, 0.0)


def _strongest(
    power: Float64[np.ndarray, "z y x"],
) -> tuple[Float64[np.ndarray, "cell 3"], Float64[np.ndarray, "cell"]]:
    """The strongest cells where people are, and their amplitudes."""
    first = np.ceil((_LOW_M - _START_M) / _STEP_M - 1e-3).astype(int)
    last = np.floor((_HIGH_M - _START_M) / _STEP_M + 1e-3).astype(int)
    near = power[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))]
    flat = near.reshape(-1)
    best = strongest_cells(flat)
    cells = np.stack(np.unravel_index(best, near.shape), axis=-1) + first
    return _ours((_START_M + cells * _STEP_M)[:, ::-1]), np.sqrt(flat[best])
