# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files: 3D Gaussians in (binary little-endian)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import AddonError

#: First spherical-harmonics basis function, 1/(2·sqrt(π)): colour = 0.5 + C0·f_dc.
SH_C0 = 0.28209479177387814

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "<i2", "int16": "<i2", "ushort": "<u2", "uint16": "<u2",
    "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4",
    "float": "<f4", "float32": "<f4", "double": "<f8", "float64": "<f8",
}  # fmt: skip

_NEEDED = (
    "x",
    "y",
    "z",
    "opacity",
    *(f"scale_{i}" for i in range(3)),
    *(f"rot_{i}" for i in range(4)),
)


@dataclass(frozen=True)
class Cloud:
    """Gaussians with activations applied."""

    means: np.ndarray
    """Centres [m], float32 [M, 3]."""
    scales: np.ndarray
    """Standard deviations along the own axes [m], float32 [M, 3]."""
    quats: np.ndarray
    """Unit quaternions, w first, float32 [M, 4]."""
    opacities: np.ndarray
    """Opacities in [0, 1], float32 [M]."""
    colors: np.ndarray
    """Display colours, sRGB-encoded as 3DGS trains them, in [0, 1], float32 [M, 3]."""

    def __len__(self) -> int:
        return len(self.means)


def read_gaussians(path: Path) -> Cloud:
    """Reads a 3DGS PLY: logit opacity, log scales, quaternion w first, colour in f_dc.

    Gaussians without colour are grey, as the convention's zero f_dc means.

    Raises:
        AddonError: The file is missing, not such a PLY, truncated or holds bad numbers.
    """
    table = _read_vertices(path)
    missing = [name for name in _NEEDED if name not in (table.dtype.names or ())]
    if missing:
        raise AddonError(f"{path}: not a 3DGS PLY, vertices lack {', '.join(missing)}")

    def columns(*names: str) -> np.ndarray:
        return np.stack([table[name].astype(np.float32) for name in names], axis=-1)

    means = columns("x", "y", "z")
    logits = columns("opacity")[:, 0]
    log_scales = columns("scale_0", "scale_1", "scale_2")
    quats = columns("rot_0", "rot_1", "rot_2", "rot_3")
    if "f_dc_0" in table.dtype.names:
        colors = 0.5 + SH_C0 * columns("f_dc_0", "f_dc_1", "f_dc_2")
    else:
        colors = np.full_like(means, 0.5)
    for name, values in (
        ("position", means), ("scale", log_scales), ("rotation", quats), ("colour", colors),
    ):  # fmt: skip
        if not np.isfinite(values).all():
            raise AddonError(f"{path}: {name} holds numbers that are not finite")
    if np.isnan(logits).any() or (log_scales > 10).any():
        raise AddonError(f"{path}: opacity or scale is out of range; expected logits and logs")
    length = np.linalg.norm(quats, axis=1, keepdims=True)
    identity = np.array([1, 0, 0, 0], np.float32)
    return Cloud(
        means=means,
        scales=np.exp(log_scales),
        quats=np.where(length > 0, quats / np.where(length > 0, length, 1), identity),
        opacities=1 / (1 + np.exp(-np.clip(logits, -60, 60))),
        colors=np.clip(colors, 0, 1),
    )


def _read_vertices(path: Path) -> np.ndarray:
    """The first element, which must be `vertex`, as a structured array."""
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise AddonError(f"{path}: no such file") from error
    except OSError as error:
        raise AddonError(f"{path}: cannot be read ({error.strerror})") from error
    end = data.find(b"end_header")
    body = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or body == 0:
        raise AddonError(f"{path}: expected a PLY file")
    count, fields = _parse_header(path, data[:end].decode("ascii", "replace"))
    dtype = np.dtype(fields)
    have = len(data) - body
    if have < count * dtype.itemsize:
        raise AddonError(
            f"{path}: truncated, {count} vertices need {count * dtype.itemsize} bytes, got {have}"
        )
    return np.frombuffer(data, dtype, count, body)


def _parse_header(path: Path, header: str) -> tuple[int, list[tuple[str, str]]]:
    count, fields, element = -1, [], ""
    for line in header.splitlines()[1:]:
        words = line.split()
        if not words or words[0] in {"comment", "obj_info"}:
            continue
        if words[0] == "format":
            if words[1:2] != ["binary_little_endian"]:
                raise AddonError(
                    f"{path}: expected binary_little_endian, got {' '.join(words[1:])}"
                )
        elif words[0] == "element" and len(words) == 3 and words[2].isdigit():
            if element == "" and words[1] != "vertex":
                raise AddonError(f"{path}: expected vertices first, got element {words[1]!r}")
            element = words[1]
            count = int(words[2]) if element == "vertex" else count
        elif words[0] == "property" and len(words) == 3 and words[1] in _TYPES:
            if element == "vertex":
                fields.append((words[2], _TYPES[words[1]]))
        elif words[0] == "property" and element != "vertex":
            continue
        else:
            raise AddonError(f"{path}: header line {line.strip()!r} is not understood")
    if count < 0 or not fields or len({name for name, _ in fields}) != len(fields):
        raise AddonError(f"{path}: the header describes no vertices")
    return count, fields
