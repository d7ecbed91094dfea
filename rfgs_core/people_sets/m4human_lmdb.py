# SPDX-License-Identifier: Apache-2.0
"""M4Human in the smaller form that its authors offer: `rf3dpose_all/*.lmdb` (some 50 GB).

Keys are `[person, action, frame]` as Python writes a list. `radar_comp.lmdb` holds the cells of
tensors that are not zero and `radar_pc.lmdb` points, both as rows of float32 behind their shape;
`params.lmdb` and `calib.lmdb` hold MessagePack, arrays as `{"__nd__": true, "dtype", "shape",
"data"}`. Read after github.com/FanJunqiao/M4Human (`lmdb_utils.py`, `m4human_dataset.py`). Tensors
come first where both are there. `indeces.pkl.gz`, the authors' splits, is a pickle and not read:
every frame is judged, as our network saw none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.lmdb_file import LmdbFile
from rfgs_core.people_sets.m4human_frame import (
    ASSUMPTIONS,
    Heard,
    heard_cells,
    heard_points,
    joints_seen,
    to_radar,
)
from rfgs_core.people_sets.model import Claim, Found, HeardFrame

_TENSORS, _POINTS, _FITS, _CALIBRATIONS = (
    f"{name}.lmdb" for name in ("radar_comp", "radar_pc", "params", "calib")
)
_KEY = re.compile(rb"\[(\d{1,9}), (\d{1,9}), (\d{1,9})\]")
_MOST_BYTES = 2**24


@dataclass(frozen=True)
class M4HumanLmdb:
    """The set."""

    found: Found

    name = "M4Human"
    claims: tuple[Claim, ...] = ()
    assumptions: tuple[str, ...] = ASSUMPTIONS

    @staticmethod
    def at(folder: Path) -> M4HumanLmdb | None:
        """The set in a folder; None if there is none."""
        for home in (folder, folder / "rf3dpose_all", folder / "MR-Mesh" / "rf3dpose_all"):
            heard = [home / name for name in (_TENSORS, _POINTS) if (home / name).is_file()]
            if heard and (home / _FITS).is_file() and (home / _CALIBRATIONS).is_file():
                return M4HumanLmdb(Found(home, tuple(heard)))
        return None

    @cached_property
    def _keys(self) -> list[bytes]:
        """Keys of all frames, by person, action and frame."""
        with LmdbFile(self.found.parts[0]) as heard:
            found = [match for match in map(_KEY.fullmatch, heard.keys()) if match]
        return [
            match[0] for match in sorted(found, key=lambda match: [int(n) for n in match.groups()])
        ]

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._keys)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame; those without a whole fit or a calibration are left out."""
        fits, calibrations = (self.found.folder / name for name in (_FITS, _CALIBRATIONS))
        with (
            LmdbFile(self.found.parts[0]) as heard,
            LmdbFile(fits) as fitted,
            LmdbFile(calibrations) as calibrated,
        ):
            for key in self._keys[::every]:
                told = fitted.get(key, _MOST_BYTES), calibrated.get(key, _MOST_BYTES)
                rows = heard.get(key, _MOST_BYTES)
                if told[0] is None or told[1] is None or rows is None:
                    continue
                turn, shift = to_radar(calibrations, *_calibration(calibrations, told[1]))
                rows_of_joints = _array(fits, told[0], "joints", 2)
                # The authors leave out frames that motion capture lost as well.
                if not np.isfinite(rows_of_joints).all():
                    continue
                joints = joints_seen(fits, rows_of_joints, turn, shift)
                points, amplitude = _heard(self.found.parts[0], rows)
                yield HeardFrame(points, amplitude, joints, None)


def _calibration(path: Path, packed: bytes) -> tuple[np.ndarray, ...]:
    turns = [_array(path, packed, f"{n}_to_cam_rotmatrix", 2, (3, 3)) for n in ("vicon", "radar")]
    shifts = [_array(path, packed, f"{n}_to_cam_tvec", 1, (3,)) for n in ("vicon", "radar")]
    if not all(np.isfinite(values).all() for values in (*turns, *shifts)):
        raise RfgsFormatError(f"{path}: expected finite numbers of calibrations")
    return turns[0], shifts[0], turns[1], shifts[1]


def _heard(path: Path, packed: bytes) -> Heard:
    """Rows of four float32 behind their number of axes and shape."""
    head = np.frombuffer(packed[:12], "<u4") if len(packed) >= 12 else np.zeros(3, np.uint32)
    if head[0] != 2 or head[2] != 4 or len(packed) != 12 + 16 * int(head[1]):
        raise RfgsFormatError(f"{path}: expected rows of four float32, found {len(packed)} bytes")
    rows = np.frombuffer(packed, "<f4", offset=12).reshape(-1, 4)
    return (heard_cells if path.name == _TENSORS else heard_points)(path, rows)


def _array(
    path: Path, packed: bytes, name: str, axes: int, shape: tuple[int, ...] | None = None
) -> Float64[np.ndarray, "..."]:
    """An array of numbers of a dictionary of arrays."""
    try:
        told: Any = msgspec.msgpack.decode(packed)[name]
        kind, lengths = np.dtype(str(told["dtype"])), tuple(int(n) for n in told["shape"])
        if kind.kind != "f" or min(lengths, default=0) < 0 or len(lengths) != axes:
            raise ValueError
        if prod(lengths) * kind.itemsize != len(told["data"]) or (shape and lengths != shape):
            raise ValueError
        return np.frombuffer(told["data"], kind).reshape(lengths).astype(np.float64)
    except (msgspec.DecodeError, KeyError, TypeError, ValueError, RecursionError):
        raise RfgsFormatError(f"{path}: expected an array {name} of numbers") from None
