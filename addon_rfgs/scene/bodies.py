# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether people are closed bodies with their normals outwards, as radio takes them to be."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .findings import Finding
from .people import Instance
from .survey import Surface

#: Vertices this close are one that an importer split [m].
SPLIT_M = 1e-4
#: The tracer itself takes vertices this close for one: seams of textures are no openings [m].
_WELDED_M = 1e-5
#: From this share of edges on, an open body is more than a slip.
_OPEN_SHARE = 0.01


def body_findings(instances: Iterable[Instance]) -> list[Finding]:
    """Names people whose mesh is open, branches, or is turned inside out."""
    findings = []
    for person in (item for item in instances if item.kind == "person"):
        for surface in person.surfaces:
            findings += _seams_finding(surface)
            if inside_out(surface.vertices, surface.faces):
                message = "has its normals inwards, so the side away from the antennas reflects"
                remedy = "recalculate them outside (Mesh > Normals)"
                findings.append(Finding("warning", surface.key, message, remedy, "inside_out"))
    return findings


def seams(faces: np.ndarray) -> tuple[int, int, int]:
    """Counts edges of triangles [T, 3]: of one face only, of more than two, and all."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    return int((count == 1).sum()), int((count > 2).sum()), len(count)


def welded(vertices: np.ndarray, faces: np.ndarray, nearest_m: float = SPLIT_M) -> np.ndarray:
    """Triangles [T', 3] with split vertices as one, and without those that vanish then."""
    _, one = np.unique(np.round(vertices / nearest_m).astype(np.int64), axis=0, return_inverse=True)
    joined = one.reshape(-1)[faces]
    a, b, c = joined.T
    return joined[(a != b) & (b != c) & (c != a)]


def inside_out(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Whether the triangles [T, 3] of a body enclose a negative volume."""
    corners = vertices[faces] - vertices.mean(axis=0)
    six = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    # A sheet that encloses next to nothing has no inside.
    return bool(six.sum() < -1e-3 * np.abs(six).sum())


def _seams_finding(surface: Surface) -> list[Finding]:
    free, crowded, total = seams(welded(surface.vertices, surface.faces, _WELDED_M))
    if not free + crowded:
        return []
    left = sum(seams(welded(surface.vertices, surface.faces))[:2])
    split = left < free + crowded
    message = f"is no closed body: {free} open edges and {crowded} of more than two faces"
    message += f" among {total}"
    remedy = "merge its vertices by distance" if split else "close its holes if they are large"
    severity = "warning" if free + crowded > _OPEN_SHARE * total else "info"
    return [Finding(severity, surface.key, message, remedy, "split_body" if split else "open_body")]
