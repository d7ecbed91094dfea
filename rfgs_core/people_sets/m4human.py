# SPDX-License-Identifier: Apache-2.0
"""M4Human (Fan et al., CVPR 2026, arXiv 2512.12378): a mmWave radar, motion capture, SMPL-X.

`p1/actions/12/mmwave/*.mat` (MATLAB up to 7.2) hold `RawPoints`, rows of x (across), y (ahead),
z (up) [m] and intensity, beside the tensor `rawImage_XYZ` (121, 111, 31), which is not used here;
`p1/parameters/12.json` holds `joints` [m] of every frame in the axes of the motion capture, and
`p1/ins_ext` how they lie to a camera and the radar (`vicon_to_cam.txt` with a shift in millimetres,
`radar2rgb_rotmatrix.txt`, `radar2rgb_tvec.txt` in metres; of p14 and p19 in a folder for some
actions). Row i of the joints belongs to the i-th of the names in `mmwave` and `rgb` together. Read
after github.com/FanJunqiao/M4Human (`m4human_utils.py`, `data_loader_Load_data.py`,
`data_loader_camera_calibration.py`).

The loader takes row 0 of the joints as the pelvis and its model's joints from SMPL-X, so the rows
are taken as those of SMPL-X. Its grid reaches from 0 to 3 m in height, so heights count from the
floor; how high the radar hangs it does not say. The same set as LMDB files is not read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.capture.file_bytes import read_bytes
from rfgs_core.capture.table_file import read_tables
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.people_sets.mmbody import SMPLX
from rfgs_core.people_sets.model import Claim, Found, HeardFrame, joints_of
from rfgs_core.records import read_record

#: Height of the radar above the floor [m]; assumed, see the module.
RADAR_M = 1.5
_MOST_POINTS = 1_000_000
_REMEDY = "expected M4Human as it is published (p1/actions/1/mmwave, p1/parameters/1.json)"


@dataclass(frozen=True)
class _Fit:
    """What is read of the fitted bodies of an action."""

    joints: list[list[list[float]]]


@dataclass(frozen=True)
class M4Human:
    """The set."""

    found: Found

    name = "M4Human"
    claims: tuple[Claim, ...] = ()
    assumptions: tuple[str, ...] = (
        "joints are those of SMPL-X, row by row",
        f"heights count from the floor, the radar hangs {RADAR_M:g} m above it",
    )

    @staticmethod
    def at(folder: Path) -> M4Human | None:
        """The set in a folder; None if there is none."""
        parts = [
            path.parent
            for path in folder.glob("p*/actions/*/mmwave")
            if _fit_of(path.parent).is_file()
        ]
        return M4Human(Found(folder, tuple(sorted(parts, key=_order)))) if parts else None

    @cached_property
    def _files(self) -> list[tuple[Path, int, Path]]:
        """Every frame: its action, row of the joints, and points."""
        found = []
        for part in self.found.parts:
            numbers = {
                int(path.stem)
                for path in (*(part / "mmwave").glob("*.mat"), *(part / "rgb").glob("*.png"))
                if path.stem.isdecimal()
            }
            files = {int(p.stem): p for p in (part / "mmwave").glob("*.mat") if p.stem.isdecimal()}
            rows = enumerate(sorted(numbers))
            found += [(part, row, files[number]) for row, number in rows if number in files]
        return found

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._files)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame; those that no joints were fitted to are left out."""
        last: tuple[Path | None, list[Float64[np.ndarray, "17 3"]]] = (None, [])
        for part, row, file in self._files[::every]:
            if last[0] != part:
                last = part, _joints(part)
            if row < len(last[1]):
                points = _points(file)
                yield HeardFrame(points, np.ones(len(points)), last[1][row], None)


def _fit_of(action: Path) -> Path:
    return action.parent.parent / "parameters" / f"{action.name}.json"


def _order(action: Path) -> tuple[tuple[int, str], ...]:
    """Persons and actions by number."""
    names = (action.parent.parent.name, action.name)
    return tuple((int("0" + "".join(re.findall("[0-9]", name))[:9]), name) for name in names)


def _points(path: Path) -> Float64[np.ndarray, "point 3"]:
    rows = read_tables(path, "mat").get("RawPoints")
    if rows is None or rows.ndim != 2 or rows.shape[1] < 3 or rows.dtype.kind not in "fiu":
        shape = "none" if rows is None else str(rows.shape)
        raise RfgsFormatError(f"{path}: expected RawPoints (N, 4), found {shape}; {_REMEDY}")
    if len(rows) > _MOST_POINTS:
        raise RfgsFormatError(f"{path}: {len(rows)} points, at most {_MOST_POINTS} are read")
    places = rows[:, :3].astype(np.float64)
    # Rows of zeros fill up the loader's own copies.
    return places[np.isfinite(places).all(axis=1) & places.any(axis=1)] - [0.0, 0.0, RADAR_M]


def _joints(action: Path) -> list[Float64[np.ndarray, "17 3"]]:
    """Joints of every frame of an action, seen from the radar."""
    path = _fit_of(action)
    frames = read_record(path, _Fit, _REMEDY).joints
    turn, shift = _to_radar(action)
    found = []
    for joints in frames:
        if len(joints) <= max(SMPLX.values()) or any(len(row) != 3 for row in joints):
            raise RfgsFormatError(f"{path}: expected 22 joints of 3 numbers or more; {_REMEDY}")
        there = np.array(joints, np.float64) @ turn.T + shift - [0.0, 0.0, RADAR_M]
        found.append(joints_of(there, SMPLX))
    return found


def _to_radar(action: Path) -> tuple[Float64[np.ndarray, "3 3"], Float64[np.ndarray, "3"]]:
    """From the motion capture's axes to the radar's: x ↦ turn x + shift."""
    folder = action.parent.parent / "ins_ext"
    for path in sorted(folder.glob("action*-*")):
        ends = re.fullmatch(r"action([0-9]{1,4})-([0-9]{1,4})", path.name)
        number = int(action.name) if action.name.isdecimal() else -1
        if ends and int(ends[1]) <= number <= int(ends[2]):
            folder = path
            break
    vicon = _numbers(folder / "vicon_to_cam.txt", (12, 16)).reshape(-1, 4)
    radar = _numbers(folder / "radar2rgb_rotmatrix.txt", (9,)).reshape(3, 3)
    place = _numbers(folder / "radar2rgb_tvec.txt", (3,))
    if abs(abs(float(np.linalg.det(radar))) - 1.0) > 0.1:
        raise RfgsFormatError(f"{folder / 'radar2rgb_rotmatrix.txt'}: expected a turn; {_REMEDY}")
    back = np.linalg.inv(radar)
    return back @ vicon[:3, :3], back @ (vicon[:3, 3] / 1000.0 - place)


def _numbers(path: Path, sizes: tuple[int, ...]) -> Float64[np.ndarray, "number"]:
    if not path.is_file():
        raise RfgsError(f"{path}: no such file; {_REMEDY}")
    try:
        values = np.array(read_bytes(path).decode("ascii", "replace").split(), np.float64)
    except ValueError:
        values = np.zeros(0)
    if values.size not in sizes or not np.isfinite(values).all():
        raise RfgsFormatError(f"{path}: expected {sizes[0]} numbers; {_REMEDY}")
    return values
