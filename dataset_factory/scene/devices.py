# SPDX-License-Identifier: Apache-2.0
"""Which devices a radio uses in a scene, and whether the scene suits them."""

from __future__ import annotations

from typing import Any

import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.outline import device_radios, silence
from dataset_factory.scene.placement import Placement
from rfgs_core.dataset.schema import device_pose
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, frame_samples
from rfgs_core.radio.check import check, check_devices

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
