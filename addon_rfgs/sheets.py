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
WALL_M2 = 0.25
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
                )
            )
    return findings


def double_sheet_area(surface: Surface) -> float:
    """Area of one side of the part of a surface that has an opposite face under 1 cm away [m²]."""
    corners = surface.vertices[surface.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    large = np.flatnonzero(doubled > 2 * _SMALLEST_M2)
    if 0.5 * doubled[large].sum() < WALL_M2:
        return 0.0
    normals = crossed / np.maximum(doubled, 1e-12)[:, None]
    tree = BVHTree.FromPolygons(surface.vertices.tolist(), surface.faces.tolist())
    middles, both = corners.mean(axis=1), 0.0
    for index in large:
        for sign in (1.0, -1.0):
            way = sign * normals[index]
            start = middles[index] + 1e-5 * way
            _, facing, _, distance = tree.ray_cast(start, way, CLOSEST_M)
            if facing is not None and distance > 1e-4 and abs(way @ np.array(facing)) > _PARALLEL:
                both += 0.5 * doubled[index]
                break
    return 0.5 * both
