# SPDX-License-Identifier: Apache-2.0
"""What moves, told apart by how it is traced: vehicles as metal, everything else as points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dataset_factory.scene.bundle import Bundle


@dataclass(frozen=True)
class Movers:
    """Some of the moving triangles of a bundle, over vertices of their own."""

    kept: np.ndarray
    """Their vertices as indices into those of the bundle, int64, shape (V,)."""
    rest_vertices: np.ndarray
    """Vertices in the rest pose [m], float32, shape (V, 3)."""
    faces: np.ndarray
    """Triangles over `kept`, int64, shape (T, 3)."""
    material: np.ndarray
    """Material index of each triangle, int32, shape (T,)."""
    instance: np.ndarray
    """Instance id of each triangle, int32, shape (T,)."""
    segment: np.ndarray
    """Joint that each triangle follows or -1, int32, shape (T,)."""
    edges: np.ndarray
    """What the mesh says of each triangle's sides, as `Topology.edges`, int8, shape (T, 3)."""

    def __len__(self) -> int:
        return len(self.faces)

    def posed(self, vertices: np.ndarray) -> np.ndarray:
        """Their share of all moving vertices [m], shape (V, 3)."""
        return vertices[self.kept]


def split_movers(bundle: Bundle) -> tuple[Movers, Movers]:
    """What scatters from points (people and the like), and rigid metal (vehicles)."""
    vehicles = [row["id"] for row in bundle.instances if row["class"] == "vehicle"]
    metal = np.isin(bundle.topology.instance, vehicles)
    return _select(bundle, ~metal), _select(bundle, metal)


def _select(bundle: Bundle, triangles: np.ndarray) -> Movers:
    topology = bundle.topology
    kept, faces = np.unique(topology.faces[triangles], return_inverse=True)
    return Movers(
        kept=kept.astype(np.int64),
        rest_vertices=topology.rest_vertices[kept],
        faces=faces.reshape(-1, 3).astype(np.int64),
        material=topology.material[triangles],
        instance=topology.instance[triangles],
        segment=topology.segment[triangles],
        edges=topology.edges[triangles],
    )
