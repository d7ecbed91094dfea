# SPDX-License-Identifier: GPL-3.0-or-later
"""Walls made of two sheets that are too close for ray tracing to tell apart."""

from __future__ import annotations

import numpy as np
from mathutils.bvhtree import BVHTree

from .findings import Finding
from .survey import Surface

#: Ray tracing drops path segments shorter than this [m].
CLOSEST_M = 0.01
#: Double sheets smaller than this (one side) are furniture fittings, not walls [m²].
WALL_M2 = 0.5
#: Sheets count as parallel from this cosine between their normals.
_PARALLEL = 0.95
#: Triangles smaller than this are not looked at [m²].
_SMALLEST_M2 = 1e-3


def double_sheets(surfaces: list[Surface]) -> list[Finding]:
    """Finds static objects with large opposite faces under 1 cm apart.

    A radio material is a slab behind one face and holds its own thickness, so a thin wall is one
    sheet; of two sheets closer than a path segment may be short, one is lost at random.
    """
    findings = []
    for surface in surfaces:
        area_m2 = 0.0 if surface.moving else double_sheet_area(surface)
        if area_m2 >= WALL_M2:
            findings.append(
                Finding(
                    "error",
                    surface.key,
                    f"has {area_m2:.2g} m² of double sheet, under {CLOSEST_M * 100:g} cm thick",
                    "make it a single sheet (its material holds the thickness), make it thicker "
                    "than 1 cm, or drop it (class Ignore)",
                    "double_sheet",
                )
            )
    return findings


def double_sheet_area(surface: Surface) -> float:
    """Area of one side of the part of a surface that is thinner than 1 cm [m²].

    Looked at from inside and part by part: two bodies that touch are no double sheet.
    """
    corners = surface.vertices[surface.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    large = np.flatnonzero(doubled > 2 * _SMALLEST_M2)
    if 0.25 * doubled[large].sum() < WALL_M2:
        return 0.0
    # Normals point out where the volume that they enclose comes out positive.
    volume = np.einsum("ij,ij->i", corners[:, 0] - corners[0, 0], crossed).sum()
    inward = -np.sign(volume) * crossed / np.maximum(doubled, 1e-12)[:, None]
    tree = BVHTree.FromPolygons(surface.vertices.tolist(), surface.faces.tolist())
    part, middles, both_m2 = _parts(surface.faces), corners.mean(axis=1), 0.0
    for index in large:
        way = inward[index]
        _, normal, hit, distance = tree.ray_cast(middles[index] + 1e-5 * way, way, CLOSEST_M)
        # An opposite face of the same body has its back towards the ray.
        leaving = normal is not None and -np.sign(volume) * (way @ np.array(normal)) < -_PARALLEL
        if leaving and part[hit] == part[index] and distance > 1e-4:
            both_m2 += 0.5 * doubled[index]
    return 0.5 * both_m2


def _parts(faces: np.ndarray) -> np.ndarray:
    """Number of the connected part that each face [T, 3] belongs to, [T]."""
    label = np.arange(faces.max() + 1)
    while True:
        lowest = label[faces].min(axis=1)
        fresh = label.copy()
        np.minimum.at(fresh, faces.ravel(), np.repeat(lowest, 3))
        fresh = fresh[fresh]  # Labels are vertices: following them halves the way to the lowest.
        if np.array_equal(fresh, label):
            return label[faces[:, 0]]
        label = fresh
