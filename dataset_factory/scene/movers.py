# SPDX-License-Identifier: Apache-2.0
"""What moves, separated by how it is traced: vehicles as metal, everything else as points."""

from __future__ import annotations

import numpy as np

from dataset_factory.scene.bundle import Bundle
from rfgs_core.simulate.surface.movers import Movers


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
