# SPDX-License-Identifier: Apache-2.0
"""M4Human (Fan et al., CVPR 2026, arXiv 2512.12378): a mmWave radar, motion capture, SMPL-X.

The raw form. `p1/actions/12/mmwave/*.mat` (MATLAB up to 7.2) hold the tensor `rawImage_XYZ` (121,
111, 31) and points `RawPoints`, see `m4human_frame`; `p1/parameters/12.json` holds `joints` [m] of
every frame in the axes of the motion capture, and `p1/ins_ext` how they lie to a camera and the
radar (`vicon_to_cam.txt` with a shift in millimetres, `radar2rgb_rotmatrix.txt`,
`radar2rgb_tvec.txt` in metres; of p14 and p19 in a folder for some actions). Row i of the joints
belongs to the i-th of the names in `mmwave` and `rgb` together. Read after
github.com/FanJunqiao/M4Human (`m4human_utils.py`, `data_loader_Load_data.py`,
`data_loader_camera_calibration.py`). `m4human_lmdb` reads the smaller form.
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
from rfgs_core.people_sets.m4human_frame import (
    ASSUMPTIONS,
    Heard,
    heard_points,
    heard_tensor,
    joints_seen,
    to_radar,
)
from rfgs_core.people_sets.model import Claim, Found, HeardFrame
from rfgs_core.records import read_record

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
    assumptions: tuple[str, ...] = ASSUMPTIONS

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
                points, amplitude = _heard(file)
                yield HeardFrame(points, amplitude, last[1][row], None)


def _fit_of(action: Path) -> Path:
    return action.parent.parent / "parameters" / f"{action.name}.json"


def _order(action: Path) -> tuple[tuple[int, str], ...]:
    """Persons and actions by number."""
    names = (action.parent.parent.name, action.name)
    return tuple((int("0" + "".join(re.findall("[0-9]", name))[:9]), name) for name in names)


def _heard(path: Path) -> Heard:
    tables = read_tables(path, "mat")
    cube, rows = tables.get("rawImage_XYZ"), tables.get("RawPoints")
    if cube is not None:
        return heard_tensor(path, np.asarray(cube))
    if rows is None:
        raise RfgsFormatError(f"{path}: expected rawImage_XYZ or RawPoints; {_REMEDY}")
    return heard_points(path, rows)


def _joints(action: Path) -> list[Float64[np.ndarray, "17 3"]]:
    """Joints of every frame of an action, seen from the radar."""
    path = _fit_of(action)
    turn, shift = _to_radar(action)
    frames = read_record(path, _Fit, _REMEDY).joints
    return [joints_seen(path, joints, turn, shift) for joints in frames]


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
    return to_radar(folder, vicon[:3, :3], vicon[:3, 3], radar, place)


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
