# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene check: what was found, what was guessed, and what is wrong, as data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import bpy
import numpy as np

from .bands import out_of_band, suitable, used_bands, validity
from .bodies import body_findings
from .cameras import View, find_devices, find_views, perspective_cameras
from .content import Content, content_ready
from .enclosure import enclosed
from .findings import SEVERITIES, Finding
from .frames import file_label, unit_scale
from .lights import is_dark
from .materials import SAID, MaterialTable
from .overrides import Overrides
from .survey import Surface
from .taking_part import left_out_findings, silence_findings

SCHEMA = "rfgs-check/1"


def check_scene(
    scene: bpy.types.Scene, frames: str | None = None, overrides: Overrides | None = None
) -> dict[str, Any]:
    """Looks at the open scene without writing or refusing anything.

    Args:
        scene: Scene of the open file.
        frames: `A:B[:STEP]`, None for the scene's range.
        overrides: What the user says about the scene beside the file.

    Returns:
        The report (`report`); errors stand among its findings.

    Raises:
        AddonError: There is no such range of frames, or a name matches nothing.
    """
    with content_ready(scene, frames, overrides or Overrides()) as content:
        views: list[View] = []
        if content.ring or perspective_cameras(scene):
            views, guesses = find_views(scene, None, None, content.ring)
            content.guesses += guesses
        devices, guesses = find_devices(scene, content.overrides.devices)
        content.guesses += guesses
        table = MaterialTable(content.overrides)
        for surface in content.surfaces:
            for slot in np.unique(surface.slots):
                table.index(surface, int(slot))
        content.guesses += table.guesses
        content.findings += body_findings(content.instances)
        content.findings += weight_findings(content.surfaces)
        content.findings += material_findings(scene, content, table)
        content.findings += device_findings(content, devices)
        content.findings += left_out_findings(scene, devices) + silence_findings(devices)
        return report(scene, content, views, devices)


def report(
    scene: bpy.types.Scene, content: Content, views: list[View], devices: list[dict[str, Any]]
) -> dict[str, Any]:
    """What is known about a scene, in plain types.

    Args:
        scene: Scene of the open file.
        content: Its surfaces, instances, guesses and findings.
        views: Cameras.
        devices: Radio devices.

    Returns:
        `scene`, `objects`, `instances`, `cameras`, `devices`, `lights`, `guesses` and
        `findings`, each finding with severity, object, message, remedy, kind and material, the
        worst first.
    """
    space = content.space
    ordered = sorted(content.findings, key=lambda row: SEVERITIES.index(row.severity))
    return {
        "schema": SCHEMA,
        "file": file_label(),
        "blender_version": bpy.app.version_string,
        "scene": {
            "name": scene.name,
            "frame_start": scene.frame_start,
            "frame_end": scene.frame_end,
            "frames": content.frames,
            "fps": scene.render.fps / scene.render.fps_base,
            "unit_scale_m": unit_scale(scene),
            "bounds_m": None if space is None else space.bounds.tolist(),
            "movers_m": None if space is None else space.movers.tolist(),
        },
        "objects": _objects(content),
        "instances": [
            {**item.row(), "joints": "known" if item.rig else "unknown"}
            for item in content.instances
        ],
        "cameras": [
            {"name": view.name, "source": view.source, "made_up": content.ring is not None}
            for view in views
        ],
        "devices": devices,
        "lights": "two suns are added" if is_dark(scene) else "the scene's own",
        "guesses": content.guesses,
        "findings": [asdict(row) for row in ordered],
    }


def _objects(content: Content) -> list[dict[str, Any]]:
    owner = {surface.key: item for item in content.instances for surface in item.surfaces}
    table = MaterialTable(content.overrides)
    rows = []
    for surface in content.surfaces:
        instance = owner.get(surface.key)
        rows.append(
            {
                "name": surface.key,
                "class": instance.kind if instance else "static",
                "instance": instance.name if instance else "",
                "moving": surface.moving,
                "triangles": len(surface.faces),
                "size_m": np.ptp(surface.vertices, axis=0).tolist(),
                "materials": [_material(table, surface, int(s)) for s in np.unique(surface.slots)],
            }
        )
    return rows


def _material(table: MaterialTable, surface: Surface, slot: int) -> dict[str, Any]:
    material = surface.material(slot)
    value, why = table.decide(surface, slot)
    return {
        "name": "" if material is None else material.name,
        "radio_material": value.radio_material,
        "why": why,
        "guessed": why not in SAID,
    }


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


def material_findings(
    scene: bpy.types.Scene, content: Content, table: MaterialTable
) -> list[Finding]:
    """Names materials that are not known at the carrier, or in a device's band."""
    bands = used_bands(scene)
    found: dict[tuple[str, str], str] = {}
    for surface in content.surfaces:
        for slot in np.unique(surface.slots):
            material = surface.material(int(slot))
            value, _ = table.decide(surface, int(slot))
            name = "" if material is None else material.name
            found.setdefault((name, value.radio_material), surface.key)
    findings = []
    for (name, value), key in sorted(found.items()):
        for band in out_of_band(value, bands):
            label = f"material {name!r} is" if name else "it is"
            message = (
                f"is out of band: {label} {value}, known from {validity(value)} only, but "
                f"{band.label} uses {band.text}"
            )
            remedy = f"choose one of {', '.join(suitable(bands)) or 'none: there is no other'}"
            findings.append(Finding("warning", key, message, remedy, "material_band", name))
    return findings


def device_findings(content: Content, devices: list[dict[str, Any]]) -> list[Finding]:
    """Names devices in closed objects, outside the scene or the room, and those that differ."""
    findings = _different(devices)
    if content.space is None:
        return findings
    room = content.surroundings() if devices else None
    around = content.bounds if room is None else room.box
    for row in devices:
        place = np.array(row["position_m"])
        if (place < content.bounds[0]).any() or (place > content.bounds[1]).any():
            at = f"at {np.round(place, 2).tolist()} m"
            message, remedy = f"is a device outside the scene {at}", "move it inside"
            findings.append(Finding("warning", row["name"], message, remedy, "device_outside"))
            continue
        for surface in content.surfaces:
            if not surface.moving and device_inside(place, around, surface):
                message = f"is a device inside {surface.key!r}"
                remedy = "move it out of the object"
                findings.append(Finding("warning", row["name"], message, remedy, "device_inside"))
                break
        else:
            if room is not None and room.outside(place):
                message = "is a device outside the room around the people: only what goes through "
                message += "its walls is heard there"
                remedy = "fine if that is meant; else move it inside"
                findings.append(Finding("info", row["name"], message, remedy, "device_elsewhere"))
    return findings


def device_inside(place: np.ndarray, room: np.ndarray, surface: Any) -> bool:
    """Whether a place [3] in metres is within a closed static surface."""
    return bool(enclosed(place[None], room, surface.vertices, surface.faces)[0])


def _different(devices: list[dict[str, Any]]) -> list[Finding]:
    own = [row for row in devices if row["radio"] == "scene" and "rf" in row]
    findings = []
    for row in own[1:]:
        wrong = [name for name, value in own[0]["rf"].items() if row["rf"][name] != value]
        if wrong:
            message = f"differs from {own[0]['name']!r} in {', '.join(wrong)}"
            remedy = "all devices of the radio 'scene' are alike"
            findings.append(Finding("warning", row["name"], message, remedy, "devices_differ"))
    return findings
