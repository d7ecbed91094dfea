# SPDX-License-Identifier: Apache-2.0
"""Runs inside any Blender: a file with other add-ons' data, before and after RF-GS was used on it.

    python use_and_leave.py -- FOLDER addon_rfgs
    blender -b --python use_and_leave.py -- FOLDER bl_ext.user_default.addon_rfgs

FOLDER holds `cloud.ply` and `dataset/`, see `test_leaves_nothing.py`; `told.json` is written there.
"""

from __future__ import annotations

import importlib
import json
import os
import socket
import struct
import sys
import threading
from pathlib import Path
from typing import Any

import bpy


class OtherSettings(bpy.types.PropertyGroup):
    """What another add-on stores."""

    number: bpy.props.IntProperty()  # type: ignore[valid-type]


def foreign_handler(*_arguments: Any) -> None:
    """Another add-on's."""


def foreign_timer() -> float:
    """Another add-on's."""
    return 10.0


def foreign_file() -> None:
    """A scene that uses what add-ons use."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("Cube")
    corners = [(i, j, k) for i in (0, 2) for j in (0, 2) for k in (0, 2)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], quads)
    cube = bpy.data.objects.new("Cube", mesh)
    empty = bpy.data.objects.new("Own empty", None)
    material = bpy.data.materials.new("Paint")
    mesh.materials.append(material)
    collection = bpy.data.collections.new("RF notes")
    scene.collection.children.link(collection)
    for item in (cube, empty):
        collection.objects.link(item)
    for item in (scene, cube, mesh, material, empty, collection):
        item["other_addon"] = {"deep": {"list": [1, 2, 3]}, "text": "kept", "rfgs": 1}
    cube["rfgs_like"] = 2.5
    scene.other.number = 7
    cube.keyframe_insert("location", frame=1)
    driver = empty.driver_add("location", 0).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = cube, '["rfgs_like"]'
    bpy.app.handlers.frame_change_pre.append(foreign_handler)
    bpy.app.handlers.save_pre.append(foreign_handler)
    bpy.app.timers.register(foreign_timer, first_interval=10.0)


def snapshot() -> dict[str, Any]:
    """Everything in the file and in Blender that an add-on might leave something in."""
    manager = bpy.context.window_manager
    configurations = [manager.keyconfigs.addon, manager.keyconfigs.user] if manager else []
    return {
        "data": {f"{row.bl_rna.identifier} {row.name}": told(row) for row in everything()},
        "handlers": {
            name: [function.__name__ for function in rows]
            for name in dir(bpy.app.handlers)
            if isinstance(rows := getattr(bpy.app.handlers, name), list)
        },
        "foreign timer": bpy.app.timers.is_registered(foreign_timer),
        "keys": sorted(
            f"{keymap.name} {item.idname}"
            for configuration in configurations
            if configuration
            for keymap in configuration.keymaps
            for item in keymap.keymap_items
        ),
        # Blender keeps the list once a function was added; emptied, it is as good as none.
        "import menu": [
            function.__name__
            for function in getattr(bpy.types.TOPBAR_MT_file_import.draw, "_draw_funcs", [])
            if function.__module__ != "bl_ui.space_topbar"
        ],
        "types": sorted(name for name in dir(bpy.types) if "rfgs" in name.lower()),
        "operators": sorted(dir(bpy.ops.rfgs)),
        "attributes": sorted(
            f"{kind} {name}"
            for kind in ("Object", "Material", "Scene", "WindowManager", "Collection", "Mesh")
            for name in dir(getattr(bpy.types, kind))
            if "rfgs" in name.lower()
        ),
    }


def everything() -> list[bpy.types.ID]:
    collections = [spec for spec in bpy.data.bl_rna.properties if spec.type == "COLLECTION"]
    return [item for spec in collections for item in getattr(bpy.data, spec.identifier)]


def told(item: bpy.types.ID) -> dict[str, Any]:
    """Properties of any kind, drivers, members and users."""
    system = getattr(item, "bl_system_properties_get", lambda **_: None)(do_create=False)
    motion = getattr(item, "animation_data", None)
    return {
        "properties": plain(item),
        # Cycles adds its own to whatever is looked at.
        "system": {key: value for key, value in plain(system).items() if key != "cycles"}
        if system is not None
        else {},
        "drivers": [curve.data_path for curve in motion.drivers] if motion else [],
        "action": motion.action.name if motion and motion.action else "",
        "colour": list(getattr(item, "diffuse_color", [])),
        "modifiers": [row.name for row in getattr(item, "modifiers", [])],
        "users": item.users,
    }


def plain(value: Any) -> Any:
    """A property and all below it as JSON."""
    if hasattr(value, "keys"):
        return {key: plain(value[key]) for key in value.keys() if key != "cycles"}
    if hasattr(value, "to_list"):
        return value.to_list()
    return value if isinstance(value, (int, float, str, bool)) else str(value)


def follow_live(scene: bpy.types.Scene) -> None:
    """Shows one Gaussian that a socket of this machine sends."""
    columns = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 opacity rf_power_db".split()
    head = {"rfgs": 1, "time_s": 0, "count": 1, "columns": columns, "bytes": 48}
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send() -> None:
            reader, _ = server.accept()
            with reader:
                reader.sendall(json.dumps(head).encode() + b"\n" + struct.pack("<12f", *[0.5] * 12))

        thread = threading.Thread(target=send)
        thread.start()
        scene.rfgs.live.port = server.getsockname()[1]
        bpy.ops.rfgs.follow_live(updates=1)
        thread.join()


def use(folder: Path) -> None:
    """Everything that leaves something in the file."""
    scene, ops = bpy.context.scene, bpy.ops.rfgs
    ops.place_radio(radio="wifi")
    ops.add_device(role="RECEIVER", radio="scene", location=(1, 1, 1))
    bpy.data.objects["Own empty"].rfgs.role = "TRANSMITTER"
    bpy.data.objects["Cube"].rfgs.object_class = "PERSON"
    bpy.data.materials["Paint"].rfgs.radio_material = "brick"
    ops.guess_materials()
    ops.check_scene()
    ops.color_materials()
    scene.rfgs.jobs.frames = "1:9"
    scene.rfgs.gaussians.path = str(folder / "cloud.ply")
    ops.import_gaussians()
    ops.import_ply(filepath=str(folder / "cloud.ply"))
    ops.add_crop_box()
    ops.update_display()
    scene.rfgs.paths.dataset = str(folder / "dataset")
    ops.show_paths()
    info = {"radio": "wifi", "cell_m": 0.5, "corner_m": [0.0, 0.0, 1.0], "devices": ["ap"]}
    map_file = folder / "coverage.json"
    map_file.write_text(json.dumps({**info, "gain_db": [[[-40.0, -50.0]] * 2]}))
    scene.rfgs.coverage.path = str(map_file)
    ops.show_coverage()
    follow_live(scene)
    scene.frame_set(5)
    scene.frame_set(1)


def main(folder: Path, package: str) -> None:
    """Compares before and after, unsaved and saved."""
    if package.startswith("bl_ext"):
        import addon_utils

        def switch(on: bool) -> None:
            (addon_utils.enable if on else addon_utils.disable)(package)
    else:

        def switch(on: bool) -> None:
            addon = importlib.import_module(package)
            (addon.register if on else addon.unregister)()

    if package in bpy.context.preferences.addons:
        switch(False)
    bpy.utils.register_class(OtherSettings)
    bpy.types.Scene.other = bpy.props.PointerProperty(type=OtherSettings)
    foreign_file()
    before = snapshot()
    switch(True)
    for item in everything():
        getattr(item, "rfgs", None)  # as panels do
    switch(False)
    looked = snapshot()
    switch(True)
    use(folder)
    used = snapshot()
    bpy.ops.rfgs.remove_data()
    switch(False)
    after = snapshot()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "after.blend"))
    bpy.app.handlers.frame_change_pre.clear()
    bpy.app.handlers.save_pre.clear()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "after.blend"))
    saved = snapshot()
    row = {"before": before, "looked": looked, "used": used, "after": after, "saved": saved}
    (folder / "told.json").write_text(json.dumps(row))


if __name__ == "__main__":
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    try:
        main(Path(arguments[0]), arguments[1])
    except BaseException:
        import traceback

        traceback.print_exc()
        sys.stderr.flush()
        os._exit(3)
    sys.stdout.flush()
    os._exit(0)
