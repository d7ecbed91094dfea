# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a preset's devices stand in a scene, by the dataset factory's own rules."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import AddonError
from ..scene.enclosure import enclosed
from ..tables import RADIO_FIELDS, RADIO_PLACEMENTS
from .layout import width_m, world_elements

#: Vertices [V, 3] in metres and triangles [T, 3] of something that stands in the way.
Mesh = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Spot:
    """Place of one device; it stands upright."""

    position_m: tuple[float, float, float]
    yaw: float
    """Turn of the boresight from +X about +Z [rad]."""

    def pose(self) -> np.ndarray:
        """Rigid world_from_device [4, 4] in metres."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        matrix = np.eye(4)
        matrix[:2, :2] = [[cos, -sin], [sin, cos]]
        matrix[:3, 3] = self.position_m
        return matrix


def spots(radio: str, bounds: np.ndarray, meshes: Iterable[Mesh] = ()) -> list[Spot]:
    """Places the devices of a preset, heights alternating and clear of furniture.

    Args:
        radio: Name of a preset.
        bounds: Lower and upper corner [2, 3] of the scene [m].
        meshes: Static objects; a device inside one takes another of the radio's heights.

    Raises:
        AddonError: The arrays are longer than the walls, or there is no room for a circle.
    """
    rule = {"corners": _corners, "walls": _walls, "circle": _circle}
    row = RADIO_PLACEMENTS[radio]
    heights = [float(bounds[0, 2]) + height for height in row["heights_m"]]
    placed = []
    standing = list(meshes)
    for index, (x, y, yaw) in enumerate(rule[row["placement"]](radio, bounds)):
        own = heights[index % len(heights)]
        choices = [Spot((float(x), float(y), z), float(yaw)) for z in (own, *heights)]
        placed.append(min(choices, key=lambda spot: _hidden(radio, spot, bounds, standing)))
    return placed


def _hidden(radio: str, spot: Spot, bounds: np.ndarray, meshes: list[Mesh]) -> tuple[bool, int]:
    """Whether a device, and how many of its antennas, are inside objects."""
    fields, pose = RADIO_FIELDS[radio], spot.pose()
    antennas = [world_elements(fields, array, pose) for array in ("tx", "rx")]
    points = np.concatenate([[spot.position_m], *antennas])
    inside = np.zeros(len(points), dtype=bool)
    for vertices, faces in meshes:
        inside |= enclosed(points, bounds, vertices, faces)
    return bool(inside[0]), int(inside.sum())


def _corners(radio: str, bounds: np.ndarray) -> list[tuple[float, float, float]]:
    """In the corners, facing the centre, counter-clockwise from the smallest x and y."""
    row = RADIO_PLACEMENTS[radio]
    low, high = bounds[0] + row["inset_m"], bounds[1] - row["inset_m"]
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    centre = bounds.mean(axis=0)
    chosen = [corners[index % 4] for index in range(row["num_places"])]
    return [(x, y, np.arctan2(centre[1] - y, centre[0] - x)) for x, y in chosen]


def _circle(radio: str, bounds: np.ndarray) -> list[tuple[float, float, float]]:
    """On the largest circle around the centre, facing it, counter-clockwise from +x."""
    row = RADIO_PLACEMENTS[radio]
    size = bounds[1] - bounds[0]
    radius = 0.5 * float(size[:2].min()) - row["inset_m"]
    if radius <= 0.0:
        raise AddonError(
            f"radio {radio!r}: no circle fits into {size[0]:.2f} x {size[1]:.2f} m with "
            f"{row['inset_m']:g} m to spare; place its devices one by one"
        )
    x, y, _ = bounds.mean(axis=0)
    turns = 2.0 * np.pi * np.arange(row["num_places"]) / row["num_places"]
    return [(x + radius * np.cos(t), y + radius * np.sin(t), t + np.pi) for t in turns]


def _walls(radio: str, bounds: np.ndarray) -> list[tuple[float, float, float]]:
    """Along the walls, facing inwards, as evenly as they fit, counter-clockwise."""
    row, wide = RADIO_PLACEMENTS[radio], width_m(RADIO_FIELDS[radio])
    low, high = bounds[0, :2] + row["inset_m"], bounds[1, :2] - row["inset_m"]
    length = np.array([high[0] - low[0], high[1] - low[1]] * 2)
    # A wall takes one device after the other as long as their arrays do not overlap.
    room = (length // max(wide, 1e-3)).astype(int)
    if room.sum() < row["num_places"]:
        raise AddonError(
            f"radio {radio!r}: {row['num_places']} arrays of {wide:g} m do not fit along walls of "
            f"{length[0]:.2f} and {length[1]:.2f} m; place its devices one by one"
        )
    count = np.zeros(4, dtype=int)
    while count.sum() < row["num_places"]:
        # The next device goes where it gets most space, the first of equals.
        count[np.argmax(np.where(count < room, length / (count + 1), -1.0))] += 1
    starts = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    ways = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    return [
        (*(starts[wall] + ways[wall] * length[wall] * (k + 0.5) / count[wall]), turn)
        for wall, turn in enumerate(np.pi / 2 * np.arange(1, 5))
        for k in range(count[wall])
    ]
