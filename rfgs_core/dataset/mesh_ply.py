# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes as binary PLY."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int32
from plyfile import PlyData, PlyElement

from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_bytes
from rfgs_core.ply_file import read_elements

_WHAT = "a triangle mesh in PLY"


def write_mesh(
    path: Path, vertices: Float32[np.ndarray, "vertex 3"], faces: Int32[np.ndarray, "face 3"]
) -> None:
    """Writes a triangle mesh, little endian, in one step."""
    points = np.zeros(len(vertices), dtype=[(axis, "<f4") for axis in "xyz"])
    for index, axis in enumerate("xyz"):
        points[axis] = vertices[:, index]
    triangles = np.zeros(len(faces), dtype=[("vertex_indices", "<i4", (3,))])
    triangles["vertex_indices"] = faces
    elements = [PlyElement.describe(points, "vertex"), PlyElement.describe(triangles, "face")]
    stream = io.BytesIO()
    PlyData(elements, byte_order="<").write(stream)
    write_bytes(path, stream.getvalue())


def read_mesh(
    path: Path,
) -> tuple[Float32[np.ndarray, "vertex 3"], Int32[np.ndarray, "face 3"]]:
    """Reads a triangle mesh.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is not a PLY, truncated or not made of triangles.
    """
    ply = read_elements(path, _WHAT, {"face": {"vertex_indices": 3}})
    try:
        vertex = ply["vertex"].data
        vertices = np.stack([vertex[axis] for axis in "xyz"], axis=1).astype(np.float32)
        faces = np.asarray(ply["face"].data["vertex_indices"], np.int32).reshape(-1, 3)
    except (KeyError, ValueError, TypeError, MemoryError) as error:
        raise RfgsFormatError(f"{path}: expected {_WHAT} ({error})") from error
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise RfgsFormatError(f"{path}: expected triangles of existing vertices")
    return vertices, faces
