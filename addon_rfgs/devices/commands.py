# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `devices`: list, add, preset, duplicate, mirror, match, remove."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

import bpy
import mathutils
import numpy as np

from ..errors import AddonError
from ..files import write_json
from ..naming import closest
from ..saving import save_copy
from ..scene.bounds import MARGIN_M
from ..scene.frames import file_label, unit_scale
from ..scene.override_file import boresight
from ..tables import MOST_ELEMENTS, RADIO_CHOICES, RADIO_DEFAULTS, RADIOS
from . import authoring, empties
from .layout import wavelength_m

_ROLES = {
    "transmitter": "TRANSMITTER",
    "receiver": "RECEIVER",
    "access-point": "ACCESS_POINT",
}


def add_devices(commands: Any) -> None:
    """Adds `devices` to the commands."""
    group = commands.add_parser(
        "devices",
        help="list, add, place, copy, mirror and remove radio devices",
        description="Radio devices are Empties with a role. Lengths are in metres.",
    )
    tasks = group.add_subparsers(dest="task", required=True, metavar="TASK")
    listing = tasks.add_parser("list", help="print devices with place, boresight and radio")
    listing.add_argument("--json", type=Path, metavar="FILE", help="also write them as JSON")
    listing.set_defaults(run=_list)
    _add_add(tasks)
    preset = _task(tasks, "preset", _preset, "place all devices of a preset by its own rule")
    preset.add_argument("radio", choices=tuple(RADIOS), help="which preset")
    preset.add_argument(
        "--around",
        action="append",
        metavar="OBJECT",
        help="surround this object, and others given the same way; default: the scene's bounds",
    )
    preset.add_argument(
        "--margin-m",
        type=float,
        default=MARGIN_M,
        help=f"free space on each side of the objects ({MARGIN_M:g})",
    )
    preset.add_argument("--keep", action="store_true", help="leave this preset's older devices")
    twin = _named(tasks, "duplicate", _duplicate, "copy a device with its radio")
    twin.add_argument(
        "--offset", type=float, nargs=3, metavar=("X", "Y", "Z"), default=(0.0, 0.0, 0.5)
    )
    mirror = _named(tasks, "mirror", _mirror, "mirror a copy of a device at the scene's middle")
    mirror.add_argument("--axis", choices=("x", "y"), required=True, help="what changes its sign")
    mirror.add_argument("--move", action="store_true", help="mirror the device itself, no copy")
    _named(tasks, "match", _match, "make all devices of the scene's own radio like this one")
    _named(tasks, "remove", _remove, "remove a device")


def _task(tasks: Any, name: str, run: Callable[..., str], text: str) -> argparse.ArgumentParser:
    """A task that changes the file."""
    task = tasks.add_parser(name, help=text, description=text.capitalize())
    task.add_argument("--out", type=Path, required=True, help=".blend to save")

    def save(options: argparse.Namespace, _out: TextIO) -> str:
        done = run(options)
        save_copy(options.out)
        return f"{done}; wrote {options.out}"

    task.set_defaults(run=save)
    return task


def _named(tasks: Any, name: str, run: Callable[..., str], text: str) -> argparse.ArgumentParser:
    task = _task(tasks, name, run, text)
    task.add_argument("device", help="name of the device")
    return task


def _add_add(tasks: Any) -> None:
    add = _task(tasks, "add", _add, "add a transmitter, a receiver or an access point")
    add.add_argument("role", choices=tuple(_ROLES))
    add.add_argument("--at", type=float, nargs=3, metavar=("X", "Y", "Z"), required=True)
    add.add_argument("--look-at", type=float, nargs=3, metavar=("X", "Y", "Z"), help="default: +X")
    add.add_argument("--name", help="default: the role")
    add.add_argument("--radio", default="scene", help="'scene', 'any' or a preset (scene)")
    own = add.add_argument_group(
        "properties of the radio 'scene' (default: like the scene's other devices)"
    )
    own.add_argument("--band-ghz", type=float, nargs=2, metavar=("FROM", "TO"))
    own.add_argument("--subcarriers", type=int, metavar="N")
    for array in ("tx", "rx"):
        own.add_argument(f"--{array}", metavar="ROWSxCOLS", help="elements along local z and y")
        own.add_argument(f"--{array}-spacing-m", type=float, metavar="M", help="of neighbours")
        own.add_argument(f"--{array}-spacing-wavelengths", type=float, metavar="N")
    own.add_argument("--pattern", choices=RADIO_CHOICES["pattern"])
    own.add_argument("--polarization", choices=RADIO_CHOICES["polarization"])
    own.add_argument("--power-dbm", type=float, metavar="DBM")


def _list(options: argparse.Namespace, _out: TextIO) -> str:
    unit = unit_scale(bpy.context.scene)
    rows = [authoring.describe(item, unit) for item in empties.devices(bpy.context.scene)]
    if options.json:
        write_json(options.json, rows)
    lines = [
        f"{row['name']}  {row['role'].lower()}  {row['radio']}  at {_point(row['position_m'])} m  "
        f"looks along {_point(row['boresight'])}  tx {row['tx_rows']}x{row['tx_cols']}  "
        f"rx {row['rx_rows']}x{row['rx_cols']}"
        for row in rows
    ]
    return "\n".join(lines) or f"{file_label()}: no radio device"


def _add(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    turn = mathutils.Quaternion()
    if options.look_at:
        turn = mathutils.Quaternion(boresight(tuple(options.at), tuple(options.look_at)))
    pose = np.array(mathutils.Matrix.LocRotScale(mathutils.Vector(options.at), turn, None))
    fields = {**(empties.alike(scene) or {}), **_said(options)}
    for array in ("tx", "rx"):
        wavelengths = getattr(options, f"{array}_spacing_wavelengths")
        if wavelengths is not None:
            band = {name: fields.get(name, row) for name, row in RADIO_DEFAULTS.items()}
            fields[f"{array}_spacing_m"] = wavelengths * wavelength_m(band)
    item = empties.add_device(
        *(scene, options.name or options.role, _ROLES[options.role], options.radio),
        *(pose, fields),
    )
    return f"added {item.name}"


def _said(options: argparse.Namespace) -> dict[str, Any]:
    """Fields of the radio that the command line gives.

    Raises:
        AddonError: Something is no array, or no band.
    """
    said: dict[str, Any] = {
        "num_subcarriers": options.subcarriers,
        "tx_spacing_m": options.tx_spacing_m,
        "rx_spacing_m": options.rx_spacing_m,
        "pattern": options.pattern,
        "polarization": options.polarization,
        "power_dbm": options.power_dbm,
    }
    if options.band_ghz:
        low, high = options.band_ghz
        if not 0.01 <= low < high <= 100:
            raise AddonError(f"band-ghz: expected 0.01 <= FROM < TO <= 100, got {low:g} {high:g}")
        said |= {"freq_min_hz": low * 1e9, "freq_max_hz": high * 1e9}
    for array in ("tx", "rx"):
        text = getattr(options, array)
        if text is None:
            continue
        rows, _, cols = text.partition("x")
        if not (rows.isdecimal() and cols.isdecimal() and int(rows) and int(cols)):
            raise AddonError(f"{array}: expected ROWSxCOLS, as 8x8, got {text!r}")
        if int(rows) * int(cols) > MOST_ELEMENTS:
            raise AddonError(f"{array}: {text} is more than {MOST_ELEMENTS} elements")
        said |= {f"{array}_rows": int(rows), f"{array}_cols": int(cols)}
    return {name: value for name, value in said.items() if value is not None}


def _preset(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    bounds, meshes, room = authoring.scene_space(scene)
    if options.around:
        items = [_object(scene, name) for name in options.around]
        bounds = authoring.around(scene, items, options.margin_m)
    placed = authoring.place_radio(scene, options.radio, (bounds, meshes, room), keep=options.keep)
    more = authoring.others_of(scene, options.radio)
    return f"placed {len(placed)} devices of {options.radio}{more}"


def _duplicate(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    unit, item = unit_scale(scene), empties.named_device(scene, options.device)
    twin = empties.duplicate(scene, item)
    pose = empties.pose_of(item, unit)
    pose[:3, 3] += options.offset
    empties.set_pose(twin, pose, unit)
    return f"added {twin.name}"


def _mirror(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    chosen = [empties.named_device(scene, options.device)]
    axis = "xy".index(options.axis)
    (twin,) = authoring.mirror_devices(scene, chosen, axis, copy=not options.move)
    return f"mirrored {twin.name}"


def _match(options: argparse.Namespace) -> str:
    scene = bpy.context.scene
    source = empties.named_device(scene, options.device)
    return f"changed {authoring.match_devices(scene, source)} devices"


def _remove(options: argparse.Namespace) -> str:
    empties.remove([empties.named_device(bpy.context.scene, options.device)])
    return f"removed {options.device}"


def _object(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    if name not in scene.objects:
        raise AddonError(f"{file_label()}: no object {name!r}{closest(name, scene.objects.keys())}")
    return scene.objects[name]


def _point(values: list[float]) -> str:
    return json.dumps([round(value, 3) for value in values])
