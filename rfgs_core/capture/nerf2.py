# SPDX-License-Identifier: Apache-2.0
"""Folders in NeRF2's spectrum layout (Zhao et al. 2023).

`spectrum/00001.png` … are grey pictures, power over elevation (rows, 1 to 90°) and azimuth
(columns, 1 to 360°) in the gateway's axes; `tx_pos.csv` has the transmitter of each [m],
`gateway_info.yml` the gateway's place and orientation (quaternion, w last), and `train_index.txt`
and `test_index.txt` name the pictures of the split.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from rfgs_core.capture.file_bytes import refuse_too_many
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.yaml_file import read_yaml

NAME = "nerf2"
TITLE = "NeRF2 spectra, a folder"
SUFFIXES = ()

ELEVATIONS, AZIMUTHS = 90, 360


def looks_like(_head: bytes, path: Path) -> bool:
    """Whether a path is such a folder."""
    return (path / "gateway_info.yml").is_file() and (path / "spectrum").is_dir()


def read(path: Path) -> Reading:
    """Reads a folder.

    Returns:
        Amplitudes (picture, 1, 1, 1, direction), square roots of the pictures' levels in [0, 1]:
        they have no phases. `index` is row · 360 + column; `packets["test"]` tells the split.

    Raises:
        RfgsError: A file is missing or cannot be read.
        RfgsFormatError: The gateway or the positions are not as they should be, or no picture is.
    """
    place, quat_xyzw = _gateway(path / "gateway_info.yml")
    positions = _positions(path / "tx_pos.csv")
    refuse_too_many(path, len(positions) * ELEVATIONS * AZIMUTHS)
    test = _names(path / "test_index.txt")
    damage = {"pictures missing or not 360 × 90 grey pixels": 0}
    kept, levels = [], []
    for row in range(len(positions)):
        picture = _picture(path / "spectrum" / f"{row + 1:05d}.png")
        if picture is None:
            damage["pictures missing or not 360 × 90 grey pixels"] += 1
        else:
            kept.append(row)
            levels.append(picture)
    if not kept:
        raise RfgsFormatError(f"{path / 'spectrum'}: expected 00001.png …, 360 × 90 grey pixels")
    values = np.sqrt(np.stack(levels).astype(np.float32) / 255.0).astype(np.complex64)
    count = len(kept)
    capture = Capture(
        source=NAME,
        values=values.reshape(count, 1, 1, 1, -1),
        valid=np.ones((count, 1, 1, 1, ELEVATIONS * AZIMUTHS), bool),
        time_s=np.arange(count, dtype=np.float64),
        axis="direction",
        bins=np.arange(ELEVATIONS * AZIMUTHS, dtype=np.float64),
        index=np.arange(ELEVATIONS * AZIMUTHS),
        packets={
            "picture": np.array(kept) + 1,
            "test": np.array([f"{row + 1:05d}" in test for row in kept]),
        },
        info={"untimed": True, "orientation_xyzw": quat_xyzw, "position_m": place},
        tx_xyz=positions[kept],
        rx_xyz=np.tile(np.array(place), (count, 1)),
    )
    return reading(path, NAME, [capture], damage)


def _gateway(path: Path) -> tuple[list[float], list[float]]:
    """Place [m] and orientation of the only gateway."""
    value = read_yaml(path)
    rows = list(value.values()) if isinstance(value, dict) else []
    try:
        (row,) = rows
        place, turn = _numbers(row["position"], 3), _numbers(row["orientation"], 4)
    except (ValueError, TypeError, KeyError) as error:
        raise RfgsFormatError(
            f"{path}: expected one gateway with position (3) and orientation (4 numbers)"
        ) from error
    return place, turn


def _numbers(values: Any, count: int) -> list[float]:
    numbers = [float(value) for value in values]
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise ValueError(f"expected {count} finite numbers")
    return numbers


def _positions(path: Path) -> np.ndarray:
    """Place of each picture's transmitter [m]."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        positions = np.array([[float(cell) for cell in row] for row in rows[1:] if row])
    except OSError as error:
        raise RfgsError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, csv.Error) as error:
        raise RfgsFormatError(f"{path}: expected x,y,z [m] on each line after the first") from error
    if positions.ndim != 2 or positions.shape[1] != 3 or not np.isfinite(positions).all():
        raise RfgsFormatError(f"{path}: expected x,y,z [m] on each line after the first")
    return positions


def _names(path: Path) -> set[str]:
    """Names in a list; none where there is no list."""
    try:
        return set(path.read_text("utf-8").split())
    except (OSError, UnicodeDecodeError):
        return set()


def _picture(path: Path) -> np.ndarray | None:
    try:
        with Image.open(path) as picture:
            # The size is checked before anything is decoded.
            if picture.size != (AZIMUTHS, ELEVATIONS):
                return None
            return np.asarray(picture.convert("L"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
