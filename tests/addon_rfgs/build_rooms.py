# SPDX-License-Identifier: Apache-2.0
"""Builds rooms whose bounds mislead, and exports them; runs in its own Python.

Usage: build_rooms.py FOLDER. Writes FOLDER/<name>.blend, FOLDER/<name>/, the bundle without
devices, FOLDER/<name>_<radio>/ with the devices of a preset placed in it, and FOLDER/errors.json
with what was said where that cannot be.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
from blank_file import open_blank_file
from build_scenes import person

import addon_rfgs
from addon_rfgs.cli import run
from addon_rfgs.export.bundle import export_bundle

#: Footprint of each room [m], counter-clockwise, and its height [m].
ROOMS: dict[str, tuple[list[tuple[float, float]], float]] = {
    "low": ([(-2, -2.5), (2, -2.5), (2, 2.5), (-2, 2.5)], 2.1),
    "cloth": ([(-2.5, -2), (2.5, -2), (2.5, 2), (-2.5, 2)], 2.6),
    "scarf": ([(-2.5, -2), (2.5, -2), (2.5, 2), (-2.5, 2)], 2.6),
    "ell": ([(-3, -3), (3, -3), (3, 0.9), (0.9, 0.9), (0.9, 3), (-3, 3)], 2.6),
    "flat": ([(-2.5, -2), (2.5, -2), (2.5, 2), (-2.5, 2)], 2.6),
}


def shell(footprint: list[tuple[float, float]], height_m: float) -> None:
    """Floor, ceiling and walls, each a single sheet, in one object."""
    count = len(footprint)
    points = [(x, y, z) for z in (0.0, height_m) for x, y in footprint]
    walls = [(i, (i + 1) % count, count + (i + 1) % count, count + i) for i in range(count)]
    mesh = bpy.data.meshes.new("shell")
    mesh.from_pydata(points, [], [tuple(range(count)), tuple(range(count, 2 * count)), *walls])
    mesh.materials.append(bpy.data.materials.new("Concrete"))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("shell", mesh))


#: How far below the floor a sheet falls [m].
FALLS = {"cloth": 3.6, "scarf": 0.9}


def falling_cloth(below_m: float) -> None:
    """A sheet that nothing holds: it falls through the floor."""
    mesh = bpy.data.meshes.new("cloth")
    mesh.from_pydata([(1, 1, 0), (1.5, 1, 0), (1.5, 1.5, 0), (1, 1.5, 0)], [], [(0, 1, 2, 3)])
    cloth = bpy.data.objects.new("cloth", mesh)
    bpy.context.scene.collection.objects.link(cloth)
    for frame, z in ((1, 1.0), (5, -below_m)):
        cloth.location.z = z
        cloth.keyframe_insert("location", frame=frame)


def next_door() -> None:
    """Another room of the house: bounds hold both."""
    points = [(2.5, -3, 0), (4.5, -3, 0), (4.5, 3, 0), (2.5, 3, 0)]
    points += [(x, y, 2.6) for x, y, _ in points]
    quads = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)]
    mesh = bpy.data.meshes.new("next door")
    mesh.from_pydata(points, [], quads)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("next door", mesh))


def main(folder: Path) -> None:
    """Builds, places and exports."""
    addon_rfgs.register()
    errors = {}
    for name, (footprint, height_m) in ROOMS.items():
        open_blank_file()
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end, scene.render.fps = 1, 5, 10
        person()
        shell(footprint, height_m)
        if name in FALLS:
            falling_cloth(FALLS[name])
        if name == "flat":
            next_door()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
        export_bundle(scene, folder / name, "1:1")
        for radio in ("wifi", "uwb", "sar"):
            try:
                bpy.ops.rfgs.place_radio(radio=radio)
            except RuntimeError as error:
                errors[f"{name}_{radio}"] = str(error)
                continue
            export_bundle(scene, folder / f"{name}_{radio}", "1:1")
    # Two boxes of somebody's own: one where people are, one under the floor.
    for title, z in (("own", "1.2"), ("cellar", "-1.5")):
        command = ["devices", "add", "access-point", "--radio", "wifi", "--name", title]
        out = str(folder / "own.blend")
        source = folder / ("cloth.blend" if title == "own" else "own.blend")
        assert run([*command, "--at", "1", "1", z, "--out", out], blend=source) == 0
    (folder / "errors.json").write_text(json.dumps(errors))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
