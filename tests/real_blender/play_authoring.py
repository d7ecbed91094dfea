# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: materials are guessed and coloured, the scene is checked and repaired."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Acts as the buttons of the sidebar do and photographs what comes of it."""
    yield from stage.open_tab("RFGS_PT_material", "RFGS_PT_guesses", "RFGS_PT_check")
    scene, window = bpy.context.scene, bpy.context.window_manager.rfgs
    for name in ("oak", "oak_floor", "wall_paint", "curtain_linen"):
        if name in bpy.data.materials:
            bpy.data.materials[name].rfgs.radio_material = "AUTO"
    bpy.context.view_layer.objects.active = scene.objects["floor"]
    scene.objects["floor"].active_material.rfgs.radio_material = "floorboard"
    scene.rfgs.materials.carrier_ghz = 5.8
    stage.view.spaces.active.shading.type = "SOLID"
    yield from press(stage, "rfgs.guess_materials")
    assert window.guesses.rows
    own = colours()
    yield from press(stage, "rfgs.color_materials")
    assert colours() != own
    yield from stage.shoot("materials")
    yield from press(stage, "rfgs.color_materials")
    assert colours() == own
    scene.objects["person_body"].data.flip_normals()
    scene.objects["access_point_1"].location.x += 5
    yield from press(stage, "rfgs.check_scene")
    rows = window.check.rows
    kinds = [row.kind for row in rows]
    assert {"inside_out", "device_outside", "material_band"} <= set(kinds), kinds
    window.check.active = kinds.index("inside_out")
    yield from press(stage, "rfgs.select_finding")
    assert bpy.context.view_layer.objects.active.name == "person_body"
    yield from stage.shoot("check")
    yield from press(stage, "rfgs.repair_finding")
    assert "inside_out" not in [row.kind for row in rows]
    window.check.active = [row.kind for row in rows].index("device_outside")
    yield from press(stage, "rfgs.repair_finding")
    assert "device_outside" not in [row.kind for row in rows]
    path = stage.out / "checked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False, copy=True)
    assert rows and rows[0].message.encode() not in path.read_bytes(), "findings are not saved"
    with stage.override():
        bpy.ops.ed.undo()
    yield 0.5
    assert bpy.context.scene.objects["access_point_1"].location.x > 7, "repairs can be undone"
    yield from list_ages(stage)


def list_ages(stage: Any) -> Iterator[float]:
    """The list says that it is of before Undo, and is not repaired by, until it is made again."""
    check = bpy.context.window_manager.rfgs.check
    assert check.outdated and "device_outside" not in [row.kind for row in check.rows]
    assert not bpy.ops.rfgs.repair_finding.poll() and bpy.ops.rfgs.select_finding.poll()
    yield from stage.shoot("outdated")
    yield from press(stage, "rfgs.check_scene")
    assert not check.outdated and "device_outside" in [row.kind for row in check.rows]
    assert bpy.ops.rfgs.repair_finding.poll()
    yield from stage.shoot("checked_again")
    with stage.override():
        bpy.ops.ed.redo()
    yield 0.5
    assert bpy.context.scene.objects["access_point_1"].location.x < 7, "and done again"
    assert check.outdated


def press(stage: Any, operator: str) -> Iterator[float]:
    """Does what the button of an operator does, undo step included."""
    with stage.override("UI"):
        getattr(bpy.ops.rfgs, operator.removeprefix("rfgs."))("INVOKE_DEFAULT", True)
    yield 0.5


def colours() -> dict[str, tuple[float, ...]]:
    return {item.name: tuple(item.diffuse_color) for item in bpy.data.materials}
