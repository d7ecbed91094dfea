# SPDX-License-Identifier: Apache-2.0
"""What stands still, drawn so that one can look inside: low things solid, the rest as outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from rfgs_core.dataset import Sequence
from rfgs_core.view.frame import Mesh

#: Triangles that reach higher above the floor are left out: walls, doors and ceilings [m].
CUT_M = 1.2
#: Edges between faces that turn less than this are not drawn: a cylinder has an outline only.
SHARP_DEG = 30.0
#: Corners closer than this are one [digits after the metre].
_MERGE_DIGITS = 4


@dataclass(frozen=True)
class Room:
    """What stands still."""

    low: Mesh
    """Floor and furniture up to `CUT_M`."""
    edges: Float32[np.ndarray, "edge 2 3"]
    """Sharp and open edges of everything [m]."""


def room_of(sequence: Sequence) -> Room | None:
    """The room of a sequence, None where the data does not tell.

    Raises:
        RfgsFormatError: The mesh is damaged.
    """
    if not sequence.files.static_mesh.is_file():
        return None
    vertices, faces = sequence.static_mesh()
    return cut_open(Mesh(vertices, faces)) if len(faces) else None


def cut_open(mesh: Mesh) -> Room:
    """Cuts a mesh at `CUT_M` above its lowest point and finds its edges."""
    height = mesh.vertices[:, 2] - mesh.vertices[mesh.faces, 2].min()
    low = (height[mesh.faces] <= CUT_M).all(axis=1)
    return Room(Mesh(mesh.vertices, mesh.faces[low]), _edges(mesh))


def _edges(mesh: Mesh) -> Float32[np.ndarray, "edge 2 3"]:
    from trimesh import Trimesh
    from trimesh.grouping import group_rows

    # Files repeat a corner for each face's own normal; only merged ones have neighbours.
    solid = Trimesh(mesh.vertices, mesh.faces, process=False)
    solid.merge_vertices(digits_vertex=_MERGE_DIGITS)
    sharp = solid.face_adjacency_edges[solid.face_adjacency_angles > np.radians(SHARP_DEG)]
    single = solid.edges_sorted[group_rows(solid.edges_sorted, require_count=1)]
    rows = np.concatenate([sharp, single])
    return np.asarray(solid.vertices, np.float32)[rows]
