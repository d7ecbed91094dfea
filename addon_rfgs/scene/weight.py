# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are finer than radio can tell, and slow."""

from __future__ import annotations

from .findings import Finding
from .survey import Surface

#: More triangles than these are named: what moves is stored and traced in every frame anew.
MOST_MOVING, MOST_STATIC = 200_000, 1_000_000


def weight_findings(surfaces: list[Surface]) -> list[Finding]:
    """Says when a scene has too many faces, and which object has most of them."""
    findings = []
    for moving, most, what in ((True, MOST_MOVING, "moves"), (False, MOST_STATIC, "stands still")):
        some = [surface for surface in surfaces if surface.moving == moving]
        total = sum(len(surface.faces) for surface in some)
        if total <= most:
            continue
        largest = max(some, key=lambda surface: len(surface.faces))
        findings.append(
            Finding(
                "warning",
                largest.key,
                f"has {len(largest.faces):,} of the {total:,} triangles of what {what}, more than "
                f"{most:,} are slow",
                "lower the render level of its subdivision, or add a Decimate modifier",
                "many_faces",
            )
        )
    return findings
