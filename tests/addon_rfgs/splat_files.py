# SPDX-License-Identifier: Apache-2.0
"""3DGS PLY files of all sorts, written by plyfile, for the tests inside Blender."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement

from rfgs_core.seals import BLANK, sealed

COLUMNS = [
    *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *(f"scale_{i}" for i in range(3)),
    *(f"rot_{i}" for i in range(4)),
]
#: Without colours and normals, as few properties as a reader accepts.
BARE = [name for name in COLUMNS if name[0] != "n" and not name.startswith("f_")]
REST = [f"f_rest_{i}" for i in range(45)]
#: Byte orders that plyfile knows, and text.
FORMATS = {"little": "<", "big": ">", "text": "text"}


def rows_of(names: list[str], count: int, seed: int = 1, **kinds: str) -> np.ndarray:
    """Random rows; properties are float32 unless `kinds` says otherwise."""
    rng = np.random.default_rng(seed)
    rows = np.zeros(count, [(name, kinds.get(name, "<f4")) for name in names])
    for name in names:
        rows[name] = rng.integers(0, 100, count) if name in kinds else rng.normal(size=count)
    return rows


def write(path: Path, rows: np.ndarray, form: str = "little", faces: int = 0) -> Path:
    """Writes rows, and maybe faces behind them, as plyfile does."""
    elements = [PlyElement.describe(rows, "vertex")]
    if faces:
        triangles = np.zeros(faces, [("vertex_indices", "i4", (3,))])
        elements.append(PlyElement.describe(triangles, "face"))
    order = FORMATS[form]
    text = order == "text"
    PlyData(elements, text=text, byte_order="=" if text else order).write(str(path))
    return path


def save_sealed(path: Path, **arrays: np.ndarray) -> Path:
    """Writes arrays as the trainer does, with a seal in the archive's comment."""
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    comment = struct.pack("<H", len(BLANK)) + BLANK.encode()
    path.write_bytes(sealed(stream.getvalue()[:-2] + comment))
    return path


def write_sealed(path: Path, rows: np.ndarray) -> Path:
    """Writes rows as the trainer does, with a seal in a comment."""
    stream = io.BytesIO()
    element = PlyElement.describe(rows, "vertex")
    PlyData([element], byte_order="<", comments=[BLANK]).write(stream)
    path.write_bytes(sealed(stream.getvalue()))
    return path


def write_run(folder: Path, frames: tuple[int, ...], count: int = 40, grey: bool = False) -> Path:
    """A run folder: a cloud and its features.npz per frame, and an empty static cloud."""
    clouds = folder / "gaussians"
    clouds.mkdir(parents=True)
    write_sealed(clouds / "static.ply", rows_of(COLUMNS, 0))
    for frame in frames:
        rows = rows_of(COLUMNS, count, seed=frame)
        for index in range(3):
            rows[f"scale_{index}"] -= 4
            if grey:
                rows[f"f_dc_{index}"] = 0
        write_sealed(clouds / f"{frame:06d}.ply", rows)
        rng = np.random.default_rng(frame)
        gamma = rng.normal(size=(count, 1)) + 1j * rng.normal(size=(count, 1))
        save_sealed(
            clouds / f"{frame:06d}.features.npz",
            features=rng.normal(size=(count, 32)).astype(np.float32),
            gamma=gamma.astype(np.complex64),
            rf_power_db=rng.uniform(20, 50, count).astype(np.float32),
            track_id=rng.permutation(count),
            body=np.zeros(count, np.int64),
        )
    return folder
