# SPDX-License-Identifier: Apache-2.0
"""Boxes as meshes of as many triangles as wanted."""

from __future__ import annotations

import numpy as np

from dataset_factory.verify.physical_optics import Cuboid


def mesh_of(boxes: list[Cuboid], cells: int = 1, side_m: float = np.inf) -> tuple:
    """Triangles of all faces: `cells` along each side, more where cells are above `side_m`."""
    vertices, faces, first = [], [], 0
    for face in (face for each in boxes for face in each.faces):
        n, m = (
            max(cells, int(np.ceil(np.linalg.norm(s) / side_m))) for s in (face.side_u, face.side_v)
        )
        u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(m + 1) / m, indexing="ij")
        places = face.corner + u.reshape(-1, 1) * face.side_u + v.reshape(-1, 1) * face.side_v
        quad = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel() + first
        faces += [
            np.stack([quad, quad + m + 1, quad + m + 2], axis=1),
            np.stack([quad, quad + m + 2, quad + 1], axis=1),
        ]
        vertices.append(places)
        first += len(places)
    return np.concatenate(vertices), np.concatenate(faces)
