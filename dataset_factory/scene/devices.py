# SPDX-License-Identifier: Apache-2.0
"""Which devices a radio uses in a scene, and whether the scene suits them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dataset_factory.scene.bundle import Bundle, StaticMesh
from dataset_factory.scene.outline import device_radios, silence
from dataset_factory.scene.room import all_triangles
from rfgs_core.dataset.schema import device_pose
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, frame_samples, layout, place_devices
from rfgs_core.radio.check import check, check_devices, enclosed
from rfgs_core.radio.placement import NEARER, NOT_AT_WALL_M, SUNK_M, height_m

#: Placement rules in words.
_WHERE = {
    "corners": "in the corners of the",
    "walls": "along the walls of the",
    "circle": "on a circle around the middle of the",
}
#: A circle through a wall would name every one of its places.
_MOST_PROBLEMS = 5


def choose_devices(bundle: Bundle, radio: Radio) -> tuple[list[DevicePose], dict[str, Any] | None]:
    """The scene's own access points for a radio, else the preset's placement.

    Returns:
        The devices, and the guess that was made, None if the scene brought them.
    """
    own = _own(bundle, radio)
    if own:
        if problem := silence(bundle.devices, radio):
            raise RfgsError(f"{bundle.info['blend_name']}: {problem}")
        return _in_order(bundle, radio, own), None
    placed, in_room = Placement(radio, bundle).devices()
    guess = {
        "what": "devices",
        "object": radio.name,
        "value": f"{len(placed)} {'places of one device ' if radio.antennas_move else ''}"
        f"{_WHERE[radio.placement]} {'room that people are in' if in_room else 'scene'}",
        "why": "no Empty has a role with radio "
        + " or ".join(repr(name) for name in sorted(device_radios(radio))),
    }
    return placed, guess


def _own(bundle: Bundle, radio: Radio) -> list[DevicePose]:
    """The scene's devices that take part in a radio."""
    names = device_radios(radio)
    return [
        device_pose(row)
        for row in bundle.devices
        if row["role"] != "NONE" and row["radio"] in names
    ]


def _in_order(bundle: Bundle, radio: Radio, own: list[DevicePose]) -> list[DevicePose]:
    """The scene's devices; of one that moves its places, in the order of their names."""
    if not radio.antennas_move:
        return own
    if len(own) != radio.samples_per_frame:
        raise RfgsError(
            f"{bundle.info['blend_name']}: {len(own)} Empties for radio {radio.name!r}, which "
            f"moves through {radio.samples_per_frame} places in a frame; add Empties, or describe "
            f"a radio like it in a file, with samples_per_frame: {len(own)}"
        )
    if any(device.role != "ACCESS_POINT" for device in own):
        raise RfgsError(
            f"{bundle.info['blend_name']}: radio {radio.name!r} moves and hears itself; give all "
            "of its Empties the role access point"
        )
    return sorted(own, key=lambda device: device.name)


def check_scene(bundle: Bundle, devices: dict[str, list[DevicePose]], radios: list[Radio]) -> None:
    """Refuses scenes that a radio cannot be traced in faithfully.

    Raises:
        RfgsError: Every problem, each with its remedy, in one line.
    """
    problems = scene_problems(bundle, devices, radios)
    if problems:
        more = len(problems) - _MOST_PROBLEMS
        said = [*problems[:_MOST_PROBLEMS], *([f"{more} more like these"] if more > 0 else [])]
        raise RfgsError(f"{bundle.info['blend_name']}: " + "; also: ".join(said))


def scene_problems(
    bundle: Bundle, devices: dict[str, list[DevicePose]], radios: list[Radio]
) -> list[str]:
    """What keeps radios from being traced in a scene, each with its remedy."""
    problems = []
    meshes = [(mesh.name, mesh.vertices, mesh.faces) for mesh in bundle.static_meshes()]
    for radio in radios:
        try:
            frame_samples(radio, bundle.fps)
        except RfgsError as error:
            problems.append(str(error))
        problems += check(radio, bundle.bounds_m, bundle.materials)
        chosen = devices[radio.name]
        problems += check_devices(radio, bundle.bounds_m, chosen, meshes, bundle.room_m)
        problems += _out_of_room(bundle, radio, chosen)
    return list(dict.fromkeys(problems))


def _out_of_room(bundle: Bundle, radio: Radio, devices: list[DevicePose]) -> list[str]:
    """Why devices that nobody placed would hear nothing of the people, in one sentence.

    Where somebody put their own is theirs to say: radio through walls is a use.
    """
    if _own(bundle, radio):
        return []
    placement = Placement(radio, bundle)
    places = {device.name: np.array(device.position_m) for device in devices}
    outside = [name for name, place_m in places.items() if placement.outside(place_m)]
    if not outside or bundle.room is None:
        return []
    low, high = (", ".join(f"{value:.2f}" for value in row) for row in bundle.room.box_m)
    names = ", ".join(outside[:4]) + (", …" if len(outside) > 4 else "")
    return [
        f"radio {radio.name!r}: no place in the room around the people, ({low}) to ({high}) m, for "
        f"{len(outside)} of {len(devices)} devices ({names}); place devices in the scene (Empties "
        "with the role access point), drop what stands in the way, or give --bounds"
    ]


@dataclass
class Placement:
    """Places a radio's devices in the room around the people, clear of furniture.

    The radio's rule is tried in the scene's bounds first, from the floor under the people up: what
    fell below it does not count. Bounds are a box around everything: where that puts a device
    outside the room (under its floor, above its ceiling, behind its walls), the rule is tried in
    the room itself, and what stands in corners may come nearer to the people.
    """

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
