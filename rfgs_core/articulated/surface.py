# SPDX-License-Identifier: Apache-2.0
"""Skin of a posed body, and the facets of a mesh."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rfgs_core.articulated.turns import OPTIONS

#: Triangles with a smaller area have no direction [m²].
_SMALLEST_M2 = 1e-12


@njit(**OPTIONS)
def skinned(
    vertices: np.ndarray, bone: np.ndarray, weight: np.ndarray, turns: np.ndarray, moves: np.ndarray
) -> np.ndarray:
    """Linear blend skinning: x' = Σ_k w_k (R_k x + t_k).

    Args:
        vertices: Vertices at rest [m], shape [V, 3].
        bone: Bones of each vertex, shape [V, 4].
        weight: Their weights, rows sum to 1, shape [V, 4].
        turns: Rotation of each bone from rest, shape [B, 3, 3].
        moves: Translation of each bone [m], shape [B, 3].

    Returns:
        Vertices in the world [m], shape [V, 3].
    """
    out = np.zeros_like(vertices)
    for v in range(len(vertices)):
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        for k in range(bone.shape[1]):
            w = weight[v, k]
            if w == 0.0:
                continue
            b = bone[v, k]
            for axis in range(3):
                out[v, axis] += w * (
                    turns[b, axis, 0] * x
                    + turns[b, axis, 1] * y
                    + turns[b, axis, 2] * z
                    + moves[b, axis]
                )
    return out


@njit(**OPTIONS)
def facets_of(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres [F, 3] in metres, unit normals [F, 3] and areas [F] in m² of triangles.

    Args:
        vertices: Vertices [m], shape [V, 3].
        faces: Corners of each triangle, against the clock seen from outside, shape [F, 3].

    Returns:
        Centres, outward normals (zero where a triangle has no area), areas.
    """
    count = len(faces)
    centres, normals, areas = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for f in range(count):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy, uz = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        vx, vy, vz = (
            vertices[c, 0] - vertices[a, 0],
            vertices[c, 1] - vertices[a, 1],
            vertices[c, 2] - vertices[a, 2],
        )
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        areas[f] = 0.5 * length
        for axis in range(3):
            centres[f, axis] = (vertices[a, axis] + vertices[b, axis] + vertices[c, axis]) / 3.0
        if areas[f] > _SMALLEST_M2:
            normals[f, 0], normals[f, 1], normals[f, 2] = nx / length, ny / length, nz / length
    return centres, normals, areas


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals [V, 3] of vertices: those of their triangles, weighted by area."""
    _, normals, areas = facets_of(vertices, faces)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], areas[:, None] * normals)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
