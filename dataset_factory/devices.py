# SPDX-License-Identifier: Apache-2.0
"""Which devices a radio uses in a scene, and whether the scene suits them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dataset_factory.bundle import Bundle
from dataset_factory.outline import device_radios, silence
from rfgs_core.dataset.schema import device_pose
from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, Radio, frame_samples, layout, place_devices
from rfgs_core.radio.check import check, check_devices, enclosed

#: Placement rules in words.
_WHERE = {
    "corners": "in the corners of the scene",
    "walls": "along the walls of the scene",
    "circle": "on a circle around the middle of the scene",
}
#: A circle through a wall would name every one of its places.
_MOST_PROBLEMS = 5


def choose_devices(bundle: Bundle, radio: Radio) -> tuple[list[DevicePose], dict[str, Any] | None]:
    """The scene's own access points for a radio, else the preset's placement.

    Returns:
        The devices, and the guess that was made, None if the scene brought them.
    """
    names = device_radios(radio)
    own = [
        device_pose(row)
        for row in bundle.devices
        if row["role"] != "NONE" and row["radio"] in names
    ]
    if own:
        if problem := silence(bundle.devices, radio):
            raise RfgsError(f"{bundle.info['blend_name']}: {problem}")
        return _in_order(bundle, radio, own), None
    placed = _clear_of_furniture(radio, place_devices(radio, bundle.bounds_m), bundle)
    guess = {
        "what": "devices",
        "object": radio.name,
        "value": f"{len(placed)} {'places of one device ' if radio.antennas_move else ''}"
        f"{_WHERE[radio.placement]}",
        "why": "no Empty has a role with radio "
        + " or ".join(repr(name) for name in sorted(names)),
    }
    return placed, guess


def _clear_of_furniture(
    radio: Radio, devices: list[DevicePose], bundle: Bundle
) -> list[DevicePose]:
    """Moves placed devices to another of the radio's heights where furniture stands at theirs."""
    meshes = bundle.static_meshes()

    def hidden(device: DevicePose) -> tuple[int, int]:
        """Whether the device, and how many of its antennas, are inside objects."""
        antennas = layout(radio, [device])
        points = np.concatenate([[device.position_m], antennas.tx_xyz, antennas.rx_xyz])
        inside = np.zeros(len(points), dtype=bool)
        for mesh in meshes:
            inside |= enclosed(points, bundle.bounds_m, mesh.vertices, mesh.faces)
        return int(inside[0]), int(inside.sum())

    clear = []
    for device in devices:
        x, y, own_m = device.position_m
        heights_m = [float(bundle.bounds_m[0, 2]) + height for height in radio.heights_m]
        choices = [replace(device, position_m=(x, y, z)) for z in (own_m, *heights_m)]
        clear.append(min(choices, key=hidden))
    return clear


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
        problems += check_devices(radio, bundle.bounds_m, devices[radio.name], meshes)
    return list(dict.fromkeys(problems))
