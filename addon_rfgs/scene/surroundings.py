# SPDX-License-Identifier: GPL-3.0-or-later
"""The room around the people: what rays from where they are meet.

Bounds are a box around everything, so a fallen object or a neighbour's room widens them. What
counts for antennas is the floor under the people, the ceiling above them and the walls around.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import mathutils
import numpy as np
from mathutils.bvhtree import BVHTree

from .people import Instance
from .survey import Surface

#: So many places of people are looked around from, spread over the scene's range.
_MOST_STANDS, _MOST_SEERS = 12, 6
#: Rays up and down also start so far beside people, since a lamp or a lintel is no ceiling [m].
_ASIDE_M = 0.5
#: Shares of a person's height at which rays down and up start: below seats, above table tops.
_SHIN, _CHEST = 0.25, 0.75
#: Rays to the walls run at this share of the room's height: above doors and most furniture.
_HIGH = 0.9
#: Directions of the rays that tell what is seen: so many around, at these elevations [deg].
_AROUND, _ELEVATIONS_DEG = 12, (-30.0, 0.0, 30.0)
#: What is seen ends this share of the way before what a ray meets.
_SHORT = 0.8


@dataclass(frozen=True)
class Surroundings:
    """The room around the people."""

    box: np.ndarray  # [2, 3]
    """Floor, ceiling and walls; where there is none the scene's bounds [m]."""
    stand: np.ndarray  # [3]
    """Where people are, on the middle of the way [m]."""
    seen: np.ndarray  # [N, 3]
    """Places within the room that people see, their own first [m]."""
    tree: BVHTree
    """Everything that stands still."""

    def row(self) -> dict[str, Any]:
        """Entry `room` of `bundle.json`."""
        places = {"box_m": self.box, "stand_m": self.stand, "seen_m": self.seen}
        return {name: np.round(value, 4).tolist() for name, value in places.items()}

    def outside(self, place: np.ndarray) -> bool:
        """Whether a place [3] is under the floor, above the ceiling or sees nothing of the room."""
        if not self.box[0, 2] <= place[2] <= self.box[1, 2]:
            return True
        near = np.argsort(np.linalg.norm(self.seen - place, axis=1), kind="stable")
        return not any(_free(self.tree, place, self.seen[index]) for index in near)


def surroundings(
    surfaces: Iterable[Surface], instances: Iterable[Instance], bounds: np.ndarray
) -> Surroundings | None:
    """Looks around from where people are; None if nothing stands there to be seen.

    Args:
        surfaces: All surfaces.
        instances: All that moves; where no person does, everything counts.
        bounds: Lower and upper corner [2, 3] of the scene [m].
    """
    still = [surface for surface in surfaces if not surface.moving and len(surface.faces)]
    stands = _stands(list(instances))
    if not still or not len(stands):
        return None
    tree = _tree(still)
    box = _box(tree, stands, bounds)
    middles = stands.mean(axis=1)
    seen = _seen(tree, _spread(middles, _MOST_SEERS), bounds)
    seen = seen[(seen[:, 2] >= box[0, 2]) & (seen[:, 2] <= box[1, 2])]
    return Surroundings(box, middles[len(middles) // 2], np.concatenate([middles, seen]), tree)


def _stands(instances: list[Instance]) -> np.ndarray:
    """Boxes [S, 2, 3] of people over the scene's range, of each the largest surface."""
    people = [item for item in instances if item.kind == "person"] or instances
    largest = [max(item.surfaces, key=lambda row: len(row.vertices)) for item in people]
    boxes = [_spread(np.array(row.boxes), _MOST_STANDS // len(people) + 1) for row in largest]
    return np.concatenate(boxes) if boxes else np.zeros((0, 2, 3))


def _spread(rows: np.ndarray, most: int) -> np.ndarray:
    """At most so many rows, evenly from first to last."""
    count = min(most, len(rows))
    return rows[np.unique(np.linspace(0, len(rows) - 1, count).round().astype(int))]


def _tree(still: list[Surface]) -> BVHTree:
    first = np.cumsum([0, *(len(surface.vertices) for surface in still)])
    vertices = np.concatenate([surface.vertices for surface in still])
    faces = [surface.faces + start for surface, start in zip(still, first, strict=False)]
    return BVHTree.FromPolygons(vertices.tolist(), np.concatenate(faces).tolist())


def _way(tree: BVHTree, start: np.ndarray, way: np.ndarray) -> float:
    """How far a ray gets [m]; infinite where it meets nothing."""
    _, _, _, distance = tree.ray_cast(mathutils.Vector(start), mathutils.Vector(way))
    return np.inf if distance is None else float(distance)


def _free(tree: BVHTree, start: np.ndarray, end: np.ndarray) -> bool:
    """Whether nothing is between two places."""
    length = float(np.linalg.norm(end - start))
    return length < 1e-6 or _way(tree, start, (end - start) / length) >= length


def _box(tree: BVHTree, stands: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Floor, ceiling and walls [2, 3] around people, within the bounds."""
    box = bounds.copy()
    turns = np.arange(8) * np.pi / 4
    ring = _ASIDE_M * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    down, up = [], []
    for low, high in stands:
        middle = 0.5 * (low + high)
        shin, chest = (low[2] + share * (high[2] - low[2]) for share in (_SHIN, _CHEST))
        for spot in (middle, *(middle + ring)):
            if _free(tree, middle, spot):
                down.append(shin - _way(tree, np.array([*spot[:2], shin]), np.array([0, 0, -1.0])))
                up.append(chest + _way(tree, np.array([*spot[:2], chest]), np.array([0, 0, 1.0])))
    # Beyond an edge, or below a hatch, some rays meet nothing: most of them decide.
    floors, ceilings = np.array(down), np.array(up)
    if 2 * np.isfinite(floors).sum() >= len(floors):
        box[0, 2] = max(box[0, 2], floors[np.isfinite(floors)].min())
    if 2 * np.isfinite(ceilings).sum() >= len(ceilings):
        box[1, 2] = min(box[1, 2], ceilings[np.isfinite(ceilings)].max())
        box[:, :2] = _walls(tree, stands, box)
    else:
        box[:, :2] = _walls(tree, stands, np.stack([box[0], stands[:, 1].max(axis=0)]))
    box[:, :2] = np.clip(box[:, :2], bounds[0, :2], bounds[1, :2])
    return box


def _walls(tree: BVHTree, stands: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Lower and upper x and y [2, 2] that rays sideways reach, infinite where there is no wall."""
    level = room[0, 2] + _HIGH * (room[1, 2] - room[0, 2])
    out = np.zeros((2, 2))
    for side, sign in ((0, -1.0), (1, 1.0)):
        for axis in range(2):
            way = np.zeros(3)
            way[axis] = sign
            reached = []
            for low, high in stands:
                middle = 0.5 * (low + high)
                start = np.array([*middle[:2], level])
                # Whoever stands below a lamp or a shelf looks from where they are.
                start = start if _free(tree, middle, start) else middle
                reached.append(sign * middle[axis] + _way(tree, start, way))
            # Furniture ends some rays early, openings end some late.
            out[side, axis] = sign * np.sort(reached)[len(reached) // 2]
    return out


def _seen(tree: BVHTree, places: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Places [N, 3] on the way to what rays all around meet, within the bounds."""
    turns = np.arange(_AROUND) * 2 * np.pi / _AROUND
    found = []
    for elevation in np.radians(_ELEVATIONS_DEG):
        flat, lift = np.cos(elevation), np.sin(elevation)
        for way in np.stack([flat * np.cos(turns), flat * np.sin(turns), lift + 0 * turns], axis=1):
            for place in places:
                room = np.where(way > 0, bounds[1] - place, place - bounds[0])
                leave = float((np.maximum(room, 0.0) / np.maximum(np.abs(way), 1e-9)).min())
                found.append(place + _SHORT * min(leave, _way(tree, place, way)) * way)
    return np.array(found)
