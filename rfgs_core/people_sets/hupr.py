# SPDX-License-Identifier: Apache-2.0
"""HuPR (Lee et al., WACV 2023, arXiv 2210.12564): two crossed 77 GHz radars, joints in pictures.

`single_1/hori/000000000.npy` and `vert/` hold complex cubes (Doppler 16, range 64, angle 64,
elevation 8) as the authors' `process_iwr1843.py` makes them of raw samples; angles are transforms
over eight virtual antennas half a wavelength apart, shifted and flipped: entry i looks at the sine
(31 − i)/32. Range entry r is bin 94 − r of 256. `single_1/annot/hrnet_annot.json`, or
`hrnet_annot_test.json` for the sequences that the authors' settings list, holds 14 joints in a
picture of 256 × 256, told by a camera network: there are no joints in space to compare with.

The horizontal radar tells azimuth, the vertical one elevation; a cell is heard as the product of
both. The length of a range bin stands in no file: 4.3 cm is assumed, from 11 m in 256 bins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from rfgs_core.arrays import load_array
from rfgs_core.errors import RfgsFormatError
from rfgs_core.people_sets.model import Claim, Found, HeardFrame, joints_of, strongest_cells
from rfgs_core.records import read_record

#: Ranges, angles and Dopplers of a cube, and the first range's bin.
_RANGES, _ANGLES, _FIRST_BIN = 64, 64, 94
#: Length of a range bin [m]; assumed, see the module.
RANGE_BIN_M = 0.043
#: Rows of the 14 joints.
_ORDER = {
    "right_hip": 0, "right_knee": 1, "right_ankle": 2, "left_hip": 3, "left_knee": 4,
    "left_ankle": 5, "thorax": 6, "head": 7, "left_shoulder": 8, "left_elbow": 9, "left_wrist": 10,
    "right_shoulder": 11, "right_elbow": 12, "right_wrist": 13,
}  # fmt: skip
#: Sequences of `hrnet_annot_test.json`, in its order (the authors' mscsa_prgcn.yaml).
TEST = (
    *(15, 16, 38, 40, 41, 42, 17, 39, 244, 245, 246, 249, 250, 251, 252, 253, 254),
    *(247, 248, 255, 256),
)
_REMEDY = "expected HuPR as its preprocessing leaves it (single_1/hori/000000000.npy)"
_MOST_BYTES = 2**24


@dataclass(frozen=True)
class _Block:
    """Joints of one picture."""

    image: str
    joints: list[list[float]]


@dataclass(frozen=True)
class HuPR:
    """The set."""

    found: Found

    name = "HuPR"
    claims: tuple[Claim, ...] = (
        Claim(
            "5.04 cm mean joint error in space, RadProPoser, trained on HuPR",
            "its abstract, wizwand.com/paper/68fa7a641e209131cea82dbc, read 2026-11-24",
        ),
    )
    assumptions: tuple[str, ...] = (f"range bins of {100 * RANGE_BIN_M:g} cm",)

    @staticmethod
    def at(folder: Path) -> HuPR | None:
        """The set in a folder; None if there is none."""
        parts = [path for path in folder.glob("single_*") if path.name[7:].isdecimal()]
        parts = [path for path in parts if (path / "hori").is_dir() and (path / "vert").is_dir()]
        return HuPR(Found(folder, tuple(sorted(parts, key=_number)))) if parts else None

    @cached_property
    def _files(self) -> list[tuple[Path, str, np.ndarray]]:
        """Every frame with joints: its sequence, file name, and joints in the picture."""
        found = []
        for part in self.found.parts:
            for block in self._blocks(part):
                stem = Path(block.image).stem
                if stem.isdecimal() and (part / "hori" / f"{stem}.npy").exists():
                    found.append((part, stem, _pixels(part, block)))
        return found

    def _blocks(self, part: Path) -> list[_Block]:
        own = part / "annot" / "hrnet_annot.json"
        if own.is_file():
            return read_record(own, list[_Block], _REMEDY)
        together = self.found.folder / "hrnet_annot_test.json"
        if together.is_file() and _number(part) in TEST:
            rows = read_record(together, list[list[_Block]], _REMEDY)
            index = TEST.index(_number(part))
            return rows[index] if index < len(rows) else []
        return []

    @property
    def count(self) -> int:
        """Frames there are."""
        return len(self._files)

    def frames(self, every: int) -> Iterator[HeardFrame]:
        """Every so manieth frame."""
        for part, stem, pixels in self._files[::every]:
            both = [_power(part / view / f"{stem}.npy") for view in ("hori", "vert")]
            points, amplitude = _cells(*both)
            yield HeardFrame(points, amplitude, None, pixels)


def _number(part: Path) -> int:
    return int(part.name.removeprefix("single_"))


def _pixels(part: Path, block: _Block) -> Float64[np.ndarray, "17 2"]:
    values = [row for row in block.joints if len(row) == 2]
    if len(values) != len(_ORDER) or len(values) != len(block.joints):
        raise RfgsFormatError(
            f"{part}, {block.image[:40]}: expected 14 joints of 2 numbers; {_REMEDY}"
        )
    return joints_of(np.array(values, np.float64), _ORDER)


def _power(path: Path) -> Float64[np.ndarray, "range angle"]:
    """Power over range and the one angle that eight antennas tell."""
    cube = load_array(path, _REMEDY, 4, _MOST_BYTES)
    if cube.shape[1:3] != (_RANGES, _ANGLES) or cube.dtype.kind not in "fc":
        raise RfgsFormatError(
            f"{path}: expected a cube (16, 64, 64, 8), found {cube.shape}; {_REMEDY}"
        )
    power = np.abs(cube.astype(np.complex128)) ** 2
    return np.where(np.isfinite(power), power, 0.0).sum(axis=(0, 3))


def _cells(
    across: Float64[np.ndarray, "range angle"], up: Float64[np.ndarray, "range angle"]
) -> tuple[Float64[np.ndarray, "cell 3"], Float64[np.ndarray, "cell"]]:
    """The strongest cells of the product of both radars, and their amplitudes."""
    sine = (_ANGLES // 2 - 1 - np.arange(_ANGLES)) / (_ANGLES // 2)
    power = np.sqrt(across[:, :, None] * up[:, None, :])
    # Beyond a right angle there is nothing.
    power = np.where(sine[:, None] ** 2 + sine**2 < 1.0, power, 0.0).reshape(-1)
    best = strongest_cells(power)
    r, a, e = np.unravel_index(best, (_RANGES, _ANGLES, _ANGLES))
    range_m = (_FIRST_BIN - r) * RANGE_BIN_M
    x, z = range_m * sine[a], range_m * sine[e]
    y = np.sqrt(np.maximum(range_m**2 - x**2 - z**2, 0.0))
    return np.stack([x, y, z], axis=-1), np.sqrt(power[best])
