# SPDX-License-Identifier: Apache-2.0
"""Places a radio's devices in the room around the people, clear of furniture.

The radio's rule is tried in the scene's bounds first, from the floor under the people up: what
fell below it does not count. Bounds are a box around everything: where that puts a device outside
the room (under its floor, above its ceiling, behind its walls), the rule is tried in the room
itself, and what stands in corners may come nearer to the people.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from dataset_factory.scene.bundle import Bundle, StaticMesh
from dataset_factory.scene.room import all_triangles
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, layout, place_devices
from rfgs_core.radio.check import enclosed
from rfgs_core.radio.placement import NEARER, NOT_AT_WALL_M, SUNK_M, height_m


@dataclass
class Placement:
    """One radio in one scene."""

    radio: Radio
    bundle: Bundle
    meshes: list[StaticMesh] = field(init=False)
    triangles: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.meshes = self.bundle.static_meshes()
        self.triangles = all_triangles(self.meshes)

    def devices(self) -> tuple[list[DevicePose], bool]:
        """The devices, as many as possible inside the room and outside of objects.

        Returns:
            The devices, and whether they stand by the room instead of the bounds.

        Raises:
            RfgsError: The arrays are longer than the walls, or there is no room for a circle.
        """
        room = self.bundle.room
        placed, faulty = self._within(self._from_floor())
        if room is None or not faulty:
            return placed, False
        try:
            closer, still_faulty = self._within(room.box_m, room.stand_m)
        except RfgsError:
            return placed, False
        # What is as good in the bounds stays there.
        return (closer, True) if still_faulty < faulty else (placed, False)

    def outside(self, place_m: np.ndarray) -> bool:
        """Whether a place is outside the room around the people, where there is one."""
        room = self.bundle.room
        return room is not None and room.outside(place_m, self.triangles)

    def _from_floor(self) -> np.ndarray:
        """The bounds without what is below the floor under the people, where that is much."""
        box_m, room = self.bundle.bounds_m.copy(), self.bundle.room
        if room is not None and room.box_m[0, 2] - box_m[0, 2] > SUNK_M:
            box_m[0, 2] = room.box_m[0, 2]
        return box_m

    def _within(
        self, box_m: np.ndarray, stand_m: np.ndarray | None = None
    ) -> tuple[list[DevicePose], int]:
        """The radio's rule in a box, each device at its best place; and how many stand badly."""
        chosen, faulty = [], 0
        for device in place_devices(self.radio, box_m):
            best, least = device, (2, 0)
            for choice in self._choices(device, box_m, stand_m):
                fault = self._fault(choice, device)
                if fault < least:
                    best, least = choice, fault
                if least == (0, 0):
                    break
            chosen.append(best)
            faulty += least[0]
        return chosen, faulty

    def _choices(
        self, device: DevicePose, box_m: np.ndarray, stand_m: np.ndarray | None
    ) -> Iterator[DevicePose]:
        """The device's own place, then the radio's other heights, then places nearer to people."""
        x, y, own_m = device.position_m
        heights_m = [height_m(self.radio, box_m, wanted_m) for wanted_m in self.radio.heights_m]
        levels_m = (own_m, *(float(box_m[0, 2]) + above_m for above_m in heights_m))
        yield from (replace(device, position_m=(x, y, z)) for z in levels_m)
        if stand_m is None or self.radio.placement != "corners":
            return
        for share in NEARER:
            along_x, along_y = share * float(stand_m[0] - x), share * float(stand_m[1] - y)
            yaw = float(np.arctan2(along_y, along_x))
            quat = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
            for z in levels_m:
                place = (x + along_x, y + along_y, z)
                yield replace(device, position_m=place, quat_wxyz=quat)

    def _fault(self, device: DevicePose, rule: DevicePose) -> tuple[int, int]:
        """Whether a device is outside the room or in an object, and how many antennas are in one.

        One that came nearer to people than the rule has it keeps off what it came around.
        """
        antennas = layout(self.radio, [device])
        place = np.array(device.position_m)
        inside = self._in_objects(np.concatenate([[place], antennas.tx_xyz, antennas.rx_xyz]))
        faulty = bool(inside[0]) or self.outside(place)
        back = np.array([*np.subtract(rule.position_m, place)[:2], 0.0])
        length_m = float(np.linalg.norm(back))
        if length_m > 0.0 and not faulty:
            behind = place + min(NOT_AT_WALL_M, length_m) * back / length_m
            faulty = self.outside(behind) or bool(self._in_objects(behind[None])[0])
        return int(faulty), int(inside.sum())

    def _in_objects(self, points: np.ndarray) -> np.ndarray:
        inside = np.zeros(len(points), dtype=bool)
        for mesh in self.meshes:
            inside |= enclosed(points, self.bundle.room_m, mesh.vertices, mesh.faces)
        return inside
