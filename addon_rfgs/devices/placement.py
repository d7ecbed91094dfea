# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a preset's devices stand in a scene, by the dataset factory's own rules."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import AddonError
from ..scene.enclosure import enclosed
from ..scene.surroundings import Surroundings
from ..tables import NEARER, NOT_AT_WALL_M, RADIO_FIELDS, RADIO_PLACEMENTS, SUNK_M
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


def spots(
    radio: str, bounds: np.ndarray, meshes: Iterable[Mesh] = (), room: Surroundings | None = None
) -> list[Spot]:
    """Places the devices of a preset in the room around the people, clear of furniture.

    The preset's rule is tried in the bounds first, from the floor under the people up; where that
    puts a device outside the room, it is tried in the room itself, and what stands in corners may
    come nearer to the people.

    Args:
        radio: Name of a preset.
        bounds: Lower and upper corner [2, 3] they stand within [m].
        meshes: Static objects; a device inside one takes another of the radio's heights.
        room: The room around the people, if it is known.

    Raises:
        AddonError: The arrays are longer than the walls, there is no room for a circle, or no
            place in the room for some device.
    """
    standing = list(meshes)
    placed, faulty = _within(radio, _from_floor(bounds, room), standing, room)
    if room is not None and faulty:
        box = np.clip(room.box, bounds[0], bounds[1])
        try:
            closer, still_faulty = _within(radio, box, standing, room, nearer=True)
        except AddonError:
            closer, still_faulty = placed, faulty
        # What is as good in the bounds stays there.
        placed = closer if still_faulty < faulty else placed
        outside = sum(room.outside(np.array(spot.position_m)) for spot in placed)
        if outside:
            raise AddonError(
                f"radio {radio!r}: no place in the room around the people for {outside} of "
                f"{len(placed)} devices; place them one by one, or drop what stands in the way"
            )
    return placed


def _from_floor(bounds: np.ndarray, room: Surroundings | None) -> np.ndarray:
    """Bounds [2, 3] without what is below the floor under the people, where that is much [m]."""
    box = bounds.copy()
    # Bounds around a selection may be on another storey.
    if room is not None and bounds[0, 2] + SUNK_M < room.box[0, 2] < bounds[1, 2]:
        box[0, 2] = room.box[0, 2]
    return box


def _within(
    radio: str,
    box: np.ndarray,
    meshes: list[Mesh],
    room: Surroundings | None,
    *,
    nearer: bool = False,
) -> tuple[list[Spot], int]:
    """The preset's rule in a box, each device at its best place; and how many stand badly."""
    rule = {"corners": _corners, "walls": _walls, "circle": _circle}
    row = RADIO_PLACEMENTS[radio]
    heights = [float(box[0, 2]) + _height(radio, box, wanted) for wanted in row["heights_m"]]
    stand = room.stand if room is not None and nearer and row["placement"] == "corners" else None
    around = box if room is None else room.box
    chosen, faulty = [], 0
    for index, (x, y, yaw) in enumerate(rule[row["placement"]](radio, box)):
        own = Spot((float(x), float(y), heights[index % len(heights)]), float(yaw))
        best, least = own, (2, 0)
        for spot in _choices(own, heights, stand):
            fault = _fault(radio, spot, own, around, meshes, room)
            if fault < least:
                best, least = spot, fault
            if least == (0, 0):
                break
        chosen.append(best)
        faulty += least[0]
    return chosen, faulty


def _height(radio: str, box: np.ndarray, wanted: float) -> float:
    """Height above the floor [m]: as wanted, but below a low ceiling."""
    high = float(box[1, 2] - box[0, 2])
    return min(wanted, max(high - RADIO_PLACEMENTS[radio]["inset_m"], 0.5 * high))


def _choices(own: Spot, heights: list[float], stand: np.ndarray | None) -> Iterator[Spot]:
    """A device's own place, then the radio's other heights, then places nearer to people."""
    x, y, z = own.position_m
    levels = (z, *heights)
    yield from (Spot((x, y, level), own.yaw) for level in levels)
    if stand is None:
        return
    for share in NEARER:
        along_x, along_y = share * float(stand[0] - x), share * float(stand[1] - y)
        yaw = float(np.arctan2(along_y, along_x))
        yield from (Spot((x + along_x, y + along_y, level), yaw) for level in levels)


def _fault(
    radio: str,
    spot: Spot,
    own: Spot,
    around: np.ndarray,
    meshes: list[Mesh],
    room: Surroundings | None,
) -> tuple[int, int]:
    """Whether a device is outside the room or in an object, and how many antennas are in one.

    One that came nearer to people than the rule has it keeps off what it came around.
    """
    fields, pose = RADIO_FIELDS[radio], spot.pose()
    antennas = [world_elements(fields, array, pose) for array in ("tx", "rx")]
    place = np.array(spot.position_m)
    inside = _in_objects(np.concatenate([[place], *antennas]), around, meshes)
    faulty = bool(inside[0]) or (room is not None and room.outside(place))
    back = np.array([*np.subtract(own.position_m, place)[:2], 0.0])
    length = float(np.linalg.norm(back))
    if length > 0.0 and not faulty:
        behind = place + min(NOT_AT_WALL_M, length) * back / length
        faulty = room is not None and room.outside(behind)
        faulty |= bool(_in_objects(behind[None], around, meshes)[0])
    return int(faulty), int(inside.sum())


def _in_objects(points: np.ndarray, around: np.ndarray, meshes: list[Mesh]) -> np.ndarray:
    inside = np.zeros(len(points), dtype=bool)
    for vertices, faces in meshes:
        inside |= enclosed(points, around, vertices, faces)
    return inside


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
