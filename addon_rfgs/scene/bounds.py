# SPDX-License-Identifier: GPL-3.0-or-later
"""The box that radio sees: given, that of the room, or guessed around what moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bmesh
import numpy as np

from .findings import Finding
from .survey import Surface

#: Free space around what moves where no room encloses it [m].
MARGIN_M = 1.5
#: Least height above the lowest point, so that devices at 2.2 m have a place [m].
HEADROOM_M = 2.5
#: Beyond this the ray launching settings are not converged [m].
LARGEST_M = 15.0
#: Parts of a static scene may end this much short of what moves and still enclose it [m].
_SLACK_M = 0.1


@dataclass
class Space:
    """Where a scene is."""

    bounds: np.ndarray  # [2, 3]
    """Lower and upper corner of what radio sees [m]."""
    movers: np.ndarray  # [2, 3]
    """The same of what moves within the scene's range."""
    walled: bool
    """Whether something static stands around what moves, up to above it."""
    guesses: list[dict[str, Any]]
    findings: list[Finding]


def find_space(surfaces: list[Surface], chosen: tuple[tuple[float, ...], ...] | None) -> Space:
    """Finds the bounds of a scene in which something moves.

    Args:
        surfaces: All surfaces.
        chosen: Lower and upper corner [m] if a user gave them.
    """
    movers = _box([surface for surface in surfaces if surface.moving])
    static = _box([surface for surface in surfaces if not surface.moving])
    around = (static[0] <= movers[0] + _SLACK_M) & (static[1] >= movers[1] - _SLACK_M)
    walled = bool(around.all())
    findings = [] if np.isfinite(static).all() else [_no_room()]
    if chosen:
        bounds = np.array(chosen, dtype=np.float64)
        return Space(bounds, movers, walled, [], findings + _chosen_findings(bounds, movers))
    bounds, guesses = np.stack([np.fmin(static[0], movers[0]), np.fmax(static[1], movers[1])]), []
    if not around[:2].all():
        margin = np.array([MARGIN_M, MARGIN_M, 0.0])
        bounds = np.stack(
            [np.fmin(bounds[0], movers[0] - margin), np.fmax(bounds[1], movers[1] + margin)]
        )
        why = "no room stands around what moves"
        guesses.append(_guess(f"{MARGIN_M:g} m around what moves", why))
    if bounds[1, 2] < bounds[0, 2] + HEADROOM_M:
        bounds[1, 2] = bounds[0, 2] + HEADROOM_M
        guesses.append(_guess(f"{HEADROOM_M:g} m high", "nothing reaches higher"))
    extent = bounds[1] - bounds[0]
    if extent.max() > LARGEST_M:
        findings.append(
            Finding(
                "error",
                "the scene",
                f"the scene measures {' x '.join(f'{side:.1f}' for side in extent)} m, more than "
                f"{LARGEST_M:g} m",
                "give bounds, drop far objects (class Ignore), or check the unit scale",
            )
        )
    return Space(bounds, movers, walled, guesses, findings)


def clip(surface: Surface, bounds: np.ndarray) -> bool:
    """Cuts a static surface to the bounds; returns whether anything is left.

    Args:
        surface: Changed in place.
        bounds: Lower and upper corner [2, 3] in metres.
    """
    if (surface.low >= bounds[0] - 1e-6).all() and (surface.high <= bounds[1] + 1e-6).all():
        return True
    if (surface.low > bounds[1]).any() or (surface.high < bounds[0]).any():
        return False
    work = bmesh.new()
    try:
        corners = [work.verts.new(point) for point in surface.vertices]
        for face, slot in zip(surface.faces, surface.slots, strict=True):
            _add_face(work, [corners[index] for index in face], int(slot))
        for side, sign in ((0, -1.0), (1, 1.0)):
            for axis in range(3):
                normal, place = np.zeros(3), np.zeros(3)
                normal[axis], place[axis] = sign, bounds[side, axis]
                geometry = [*work.verts, *work.edges, *work.faces]
                bmesh.ops.bisect_plane(
                    work, geom=geometry, plane_co=place, plane_no=normal, clear_outer=True
                )
        bmesh.ops.triangulate(work, faces=work.faces)
        work.verts.index_update()
        surface.vertices = np.array([vertex.co for vertex in work.verts]).reshape(-1, 3)
        surface.faces = np.array(
            [[vertex.index for vertex in face.verts] for face in work.faces], np.int32
        ).reshape(-1, 3)
        surface.slots = np.array([face.material_index for face in work.faces], np.int32)
    finally:
        work.free()
    if not len(surface.faces):
        return False
    surface.low, surface.high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    return True


def _add_face(work: bmesh.types.BMesh, corners: list[bmesh.types.BMVert], slot: int) -> None:
    if len(set(corners)) == 3 and work.faces.get(corners) is None:
        work.faces.new(corners).material_index = slot


def _box(surfaces: list[Surface]) -> np.ndarray:
    """Corners [2, 3] of a box around surfaces; not finite where there are none."""
    low = np.min([surface.low for surface in surfaces], axis=0) if surfaces else np.full(3, np.nan)
    high = np.max([surface.high for surface in surfaces], axis=0) if surfaces else low
    return np.stack([low, high])


def _no_room() -> Finding:
    return Finding(
        "info",
        "the scene",
        "there is no room: the environment's channel is the line of sight between devices alone",
        "set room: box to trace one around it",
    )


def _chosen_findings(bounds: np.ndarray, movers: np.ndarray) -> list[Finding]:
    if (movers[0] < bounds[0] - 1e-3).any() or (movers[1] > bounds[1] + 1e-3).any():
        low, high = np.round(movers, 2).tolist()
        remedy = "enlarge them, narrow the frame range or drop what leaves"
        return [
            Finding(
                "error", "the scene", f"moves from {low} to {high} m, out of the bounds", remedy
            )
        ]
    extent = float((bounds[1] - bounds[0]).max())
    if extent > LARGEST_M:
        message = f"bounds of {extent:.1f} m: ray launching is converged up to {LARGEST_M:g} m only"
        return [Finding("warning", "the scene", message, "choose smaller bounds if you can")]
    return []


def _guess(value: str, why: str) -> dict[str, Any]:
    return {"what": "bounds", "object": "the scene", "value": value, "why": why}
