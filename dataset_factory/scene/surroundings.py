# SPDX-License-Identifier: Apache-2.0
"""What stands still in a scene bundle, as the fast tracer takes it."""

from __future__ import annotations

import numpy as np

from dataset_factory.scene.bundle import Bundle
from rfgs_core.simulate.geometry.room import Room, SlabMaterial


def room_of(bundle: Bundle) -> Room:
    """The bundle's static triangles with their slabs."""
    meshes = bundle.static_meshes()
    counts = [len(part.faces) for part in meshes]
    triangles = [part.vertices.astype(np.float64)[part.faces] for part in meshes]
    return Room(
        triangles=np.concatenate([np.zeros((0, 3, 3)), *triangles]),
        mesh=np.repeat(np.arange(len(meshes)), counts),
        material=np.repeat([part.material_index for part in meshes], counts).astype(np.int64),
        materials=tuple(
            SlabMaterial(row["radio_material"], float(row["thickness_m"]))
            for row in bundle.materials
        ),
        source=f"scene bundle {bundle.path.name}",
    )
