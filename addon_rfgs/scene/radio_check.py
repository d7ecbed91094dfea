# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene's radio devices and their bands would find wrong with it."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .bands import out_of_band, suitable, used_bands, validity
from .content import Content
from .enclosure import enclosed
from .findings import Finding
from .materials import MaterialTable


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
    """Names devices in closed objects, outside the scene or the room, and those that differ.

    Args:
        content: The scene.
        devices: Rows of `find_devices`.
    """
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
