# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as binary little-endian PLY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..files import replacing

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_mesh(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Writes vertices [V, 3] in metres and triangles [T, 3]."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), _FACE)
    rows["count"], rows["corners"] = 3, faces
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        stream.write(rows.tobytes())
