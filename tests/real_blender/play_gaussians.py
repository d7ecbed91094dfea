# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: Gaussians are imported, coloured in the Solid view, undone and redone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Clicks the buttons and notes what the file holds after each."""
    (run,) = stage.arguments
    seen: dict[str, Any] = {}
    yield from stage.open_tab()
    shading = stage.view.spaces.active.shading
    other = bpy.data.screens["Shading"]
    before = [area.spaces[0].shading.color_type for area in views(other)]
    bpy.context.scene.frame_set(1)
    settings().path = run
    settings().color_by, settings().size = "TRACK", 5.0
    bpy.ops.ed.undo_push(message="before")
    yield from stage.click("rfgs.import_gaussians")
    yield 1.0
    seen["imported"] = clouds()
    frame_clouds(stage)
    yield from stage.shoot("points", "VIEW")
    seen["at_once"] = [shading.type, shading.color_type]
    yield from stage.click("rfgs.color_solid_view")
    yield 1.0
    seen["shading"] = [shading.type, shading.color_type]
    seen["others"] = before == [area.spaces[0].shading.color_type for area in views(other)]
    yield from stage.shoot("solid", "VIEW")
    yield from stage.click("rfgs.add_crop_box")
    yield 0.5
    seen["boxes"] = len([item for item in bpy.data.objects if "crop" in item.name])
    for name in ("undo", "undo", "undo", "redo"):
        with stage.override():
            getattr(bpy.ops.ed, name)()
        yield 0.5
        boxes = len([item for item in bpy.data.objects if "crop" in item.name])
        solid = settings().solid_view
        seen.setdefault("history", []).append([name, clouds(), boxes, solid])
    yield from import_menu(stage, f"{run}/gaussians/000001.ply", seen)
    (stage.out / "seen.json").write_text(json.dumps(seen))


def import_menu(stage: Any, ply: str, seen: dict[str, Any]) -> Iterator[float]:
    """The menu's entry asks for a file; one that is dropped is taken at once."""
    with stage.override():
        bpy.ops.wm.call_menu(name="TOPBAR_MT_file_import")
    yield from stage.shoot("menu")
    for value in ("PRESS", "RELEASE"):
        stage.window.event_simulate(type="ESC", value=value, x=700, y=900)
        yield 0.2
    for dropped in (ply, ""):
        with stage.override():
            done = bpy.ops.rfgs.import_ply("INVOKE_DEFAULT", True, filepath=dropped)
        yield 1.0
        windows = bpy.context.window_manager.windows
        kinds = [area.type for window in windows for area in window.screen.areas]
        seen.setdefault("ply", []).append([*done, clouds(), "FILE_BROWSER" in kinds])


def settings() -> Any:
    return bpy.context.scene.rfgs.gaussians


def clouds() -> int:
    return len([item for item in bpy.data.objects if item.name.startswith("Gaussians")])


def views(screen: bpy.types.Screen) -> list[bpy.types.Area]:
    return [area for area in screen.areas if area.type == "VIEW_3D"]


def frame_clouds(stage: Any) -> None:
    """Looks at the visible cloud from the front, and at nothing else."""
    for item in bpy.data.objects:
        item.select_set(item.name.startswith("Gaussians 000001"))
        if item.type == "MESH" and not item.name.startswith("Gaussians"):
            item.hide_set(True)
    with stage.override():
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
    for item in bpy.data.objects:
        item.select_set(False)
