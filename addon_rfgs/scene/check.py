# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene check: what was found, what was guessed, and what is wrong, as data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import bpy
import numpy as np

from .bodies import body_findings
from .cameras import View, find_devices, find_views, perspective_cameras
from .content import Content, content_ready
from .findings import SEVERITIES
from .frames import file_label, unit_scale
from .lights import is_dark
from .materials import SAID, MaterialTable
from .overrides import Overrides
from .radio_check import device_findings, material_findings
from .survey import Surface
from .taking_part import left_out_findings, silence_findings
from .weight import weight_findings

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
