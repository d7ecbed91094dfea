# SPDX-License-Identifier: Apache-2.0
"""Files as strangers make them, each checked in one Blender; runs in its own Python.

Usage: build_any_blend.py FOLDER. Writes FOLDER/<name>.blend and FOLDER/reports.json with the
scene check of each, or its error, under `<name>` and, with overrides, `<name>+<what>`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from blank_file import open_blank_file
from build_scenes import box, person

import addon_rfgs
from addon_rfgs.cli import open_blend
from addon_rfgs.devices.empties import add_device
from addon_rfgs.errors import AddonError
from addon_rfgs.export.bundle import export_bundle
from addon_rfgs.scene.check import check_scene
from addon_rfgs.scene.override_file import read_overrides
from addon_rfgs.scene.overrides import Overrides

FOLDER = Path(sys.argv[1])

#: Overrides to try on scenes: name after the `+` → what a JSON file says.
SAID: dict[str, dict[str, Any]] = {
    "metres+unit": {"unit_scale": 0.01},
    "far+bounds": {"bounds_m": [[-3, -3, -0.1], [3, 3, 2.6]]},
    "far+tight": {"bounds_m": [[-3, -3, -0.1], [3, 0, 2.6]]},
    "far+drop": {"drop": ["tow*", "ground"]},
    "far+typo": {"drop": ["towr"]},
    "alone+room": {"room": {"size_m": [6, 6, 2.6], "material": "concrete"}},
    "alone+small": {"room": {"size_m": [0.5, 0.5, 2.6]}},
    "alone+ring": {"cameras": {"ring": 3, "radius_m": 2, "height_m": 1}, "fps": 29.97},
    "alone+range": {"frame_range": "2:5"},
    "beast+person": {"people": ["hide"]},
    "kinds+said": {
        "object_materials": {"ribbon": "metal"},
        "materials": {"paint*": {"radio_material": "glass", "thickness_m": 0.004}},
        "moving": ["sign"],
        "devices": [{"name": "ap", "position_m": [0, -2, 1.5], "look_at_m": [0, 0, 1.5]}],
    },
    "missing_library+dropped": {"drop": ["guest"]},
    "heard+fewer": {"drop": ["ap2"]},
}


def stage() -> None:
    """A walking person over three frames and nothing else."""
    open_blank_file()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 3, 24
    person()
    bpy.data.objects["body"].rfgs.object_class = "AUTO"


def link(item: bpy.types.Object, collection: bpy.types.Collection | None = None) -> None:
    """Puts an object into a collection, the scene's own by default."""
    (collection or bpy.context.scene.collection).objects.link(item)


def slide(item: bpy.types.Object, path: str, start: Any, end: Any) -> None:
    """Animates a property over the scene's range."""
    owner, _, name = path.rpartition(".")
    target = item.path_resolve(owner) if owner else item
    for frame, value in ((1, start), (3, end)):
        setattr(target, name, value)
        target.keyframe_insert(name, frame=frame)


def alone() -> None:
    """The person alone."""
    stage()


def modifiers() -> None:
    """Mirror, array, solidify, subdivision for renders only, and a shape key that moves."""
    stage()
    box("mirror", (0.1, 2, 0), (0.5, 2.2, 0.5)).modifiers.new(
        "m", "MIRROR"
    ).use_mirror_merge = False
    box("array", (1, -2, 0), (1.1, -1.9, 0.5)).modifiers.new("a", "ARRAY").count = 3
    plate = box("solid", (-2, 1, 0), (-1, 2, 0))
    plate.data.clear_geometry()
    plate.data.from_pydata([(-2, 1, 0), (-1, 1, 0), (-1, 2, 0), (-2, 2, 0)], [], [(0, 1, 2, 3)])
    plate.modifiers.new("s", "SOLIDIFY").thickness = 0.1
    fine = box("fine", (-2, -2, 0), (-1.5, -1.5, 0.5)).modifiers.new("f", "SUBSURF")
    fine.levels, fine.render_levels = 0, 2
    bulge = box("bulge", (1, 1, 0), (1.5, 1.5, 0.5))
    bulge.shape_key_add(name="Basis")
    key = bulge.shape_key_add(name="up")
    for point in key.data:
        point.co.z += 0.3
    for frame, value in ((1, 0.0), (3, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


def scatter(item: bpy.types.Object, source: bpy.types.Object | None) -> None:
    """A geometry-nodes modifier that puts a cube or an object on each vertex."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    put = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(start.outputs[0], put.inputs["Points"])
    if source is None:
        cube = tree.nodes.new("GeometryNodeMeshCube")
        cube.inputs["Size"].default_value = (0.1, 0.1, 0.1)
        tree.links.new(cube.outputs["Mesh"], put.inputs["Instance"])
    else:
        info = tree.nodes.new("GeometryNodeObjectInfo")
        info.inputs["Object"].default_value = source
        info.inputs["As Instance"].default_value = True
        tree.links.new(info.outputs["Geometry"], put.inputs["Instance"])
    tree.links.new(put.outputs["Instances"], end.inputs[0])
    item.modifiers.new("scatter", "NODES").node_group = tree


def geometry_nodes() -> None:
    """Cubes from nodes on a still and on a moving carrier, and an object instanced by nodes."""
    stage()
    scatter(box("studs", (-2, -2, 0), (-1, -1, 1)), None)
    carrier = box("swarm", (1, 1, 0), (1.6, 1.6, 1))
    scatter(carrier, None)
    slide(carrier, "location", (0, 0, 0), (0, 0, 0.2))
    model = box("model", (0, 0, 0), (0.2, 0.2, 0.2), "oak")
    model.location = (0, 2, 0)
    scatter(box("grid", (-2, 1, 0), (-1.5, 2, 0.5)), model)


def duplicates() -> None:
    """Children repeated on the vertices and on the faces of their parent."""
    stage()
    for name, kind, x in (("on_vertices", "VERTS", -2.0), ("on_faces", "FACES", 1.0)):
        parent = box(name, (x, 1, 0), (x + 1, 2, 1))
        parent.instance_type = kind
        parent.show_instancer_for_render = False
        child = box(f"{name}_child", (-0.05, -0.05, -0.05), (0.05, 0.05, 0.05))
        child.parent = parent


def visibility() -> None:
    """What is hidden in every way Blender knows."""
    stage()
    box("eye_closed", (1, 1, 0), (1.5, 1.5, 0.5)).hide_set(True)
    box("screen_only", (1, -1, 0), (1.5, -0.5, 0.5)).hide_viewport = True
    box("no_render", (-1, 1, 0), (-0.5, 1.5, 0.5)).hide_render = True
    box("ignored", (-1, -1, 0), (-0.5, -0.5, 0.5)).rfgs.object_class = "IGNORE"
    for name in ("excluded", "unrendered", "unseen"):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        item = box(f"in_{name}", (-2, -2, 0), (-1.5, -1.5, 0.5))
        bpy.context.scene.collection.objects.unlink(item)
        link(item, collection)
    layers = bpy.context.view_layer.layer_collection.children
    layers["excluded"].exclude = True
    bpy.data.collections["unrendered"].hide_render = True
    bpy.data.collections["unseen"].hide_viewport = True
    bpy.data.scenes.new("another")


def kinds() -> None:
    """One object of every kind, with names that say nothing and names that say much."""
    stage()
    curve = bpy.data.curves.new("ribbon", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.05
    line = curve.splines.new("POLY")
    line.points.add(1)
    line.points[0].co, line.points[1].co = (-2, 0, 0, 1), (-2, 0, 1, 1)
    text = bpy.data.curves.new("sign", "FONT")
    text.body, text.extrude = "RF", 0.05
    ball = bpy.data.metaballs.new("drop")
    ball.elements.new().radius = 2.0
    made = [
        (name, bpy.data.objects.new(name, data))
        for name, data in (("ribbon", curve), ("sign", text), ("drop", ball))
    ]
    for index, (_, item) in enumerate(made):
        link(item)
        item.location = (1.5, index - 1.0, 0.5) if index else (0, 0, 0)
    for name, data in (
        ("fog", bpy.data.volumes.new("fog")),
        ("fur", bpy.data.hair_curves.new("fur")),
        ("dots", bpy.data.pointclouds.new("dots")),
    ):
        link(bpy.data.objects.new(name, data))
    bpy.ops.object.grease_pencil_add(type="STROKE")
    bpy.context.object.name = "scribble"
    shelf = box("thing", (-2, 1, 0), (-1, 1.3, 1), "Oak Veneer")
    shelf.data.materials.append(bpy.data.materials.new("paint red"))
    for index, face in enumerate(shelf.data.polygons):
        face.material_index = index % 2


def people_sharing() -> None:
    """A body with clothes, and a second body a metre and a half away on the same armature."""
    stage()
    body = bpy.data.objects["body"]
    for name, x in (("shirt", 0.0), ("twin", 1.5)):
        other = body.copy()
        other.name, other.data = name, body.data.copy()
        for vertex in other.data.vertices:
            vertex.co.x += x
        link(other)


def beast() -> None:
    """A skinned mesh whose bones have names of no human rig and stand on four legs."""
    stage()
    rig = bpy.data.objects["rig"]
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in rig.data.edit_bones:
        bone.use_connect = False
    for bone in rig.data.edit_bones:
        bone.name = bone.name.replace("mixamorig:", "zz")
        # Its back lies along -y above its hips, and its arms reach the ground.
        ends = [
            (x, -(z - 1.0), 1.0) if abs(x) < 0.01 else (0.1 * np.sign(x), y - 0.4, z)
            for x, y, z in (bone.head, bone.tail)
        ]
        if any(part in bone.name for part in ("Shoulder", "Arm", "Hand")):
            ends = [(x, y, 1.0 - (abs(old.x) - 0.03)) for (x, y, _), old in
                    zip(ends, (bone.head.copy(), bone.tail.copy()), strict=True)]  # fmt: skip
        bone.head, bone.tail = ends
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects["body"].name = "hide"


def constrained() -> None:
    """Objects that move only because others do."""
    stage()
    leader = bpy.data.objects.new("leader", None)
    link(leader)
    slide(leader, "location", (0, 0, 0), (0, 0.5, 0))
    child = box("child", (1, 1, 0), (1.4, 1.4, 0.4))
    child.parent = leader
    follower = box("follower", (-2, 1, 0), (-1.6, 1.4, 0.4))
    follower.constraints.new("COPY_LOCATION").target = leader
    held = box("held", (0.7, -0.1, 1.3), (0.9, 0.1, 1.5))
    held.parent, held.parent_type = bpy.data.objects["rig"], "BONE"
    held.parent_bone = "mixamorig:LeftHand"


def metres() -> None:
    """A person drawn in centimetres in a file that says metres."""
    stage()
    bpy.data.objects["rig"].scale = (100, 100, 100)


def tiny() -> None:
    """Nothing but a fly moves."""
    stage()
    bpy.data.objects.remove(bpy.data.objects["body"])
    slide(box("fly", (0, 0, 1), (0.02, 0.02, 1.02)), "location", (0, 0, 0), (0.2, 0, 0))


def tower_moves() -> None:
    """Something 6 m tall moves."""
    stage()
    slide(box("crane", (1, 1, 0), (1.5, 1.5, 6)), "location", (0, 0, 0), (0.2, 0, 0))


def far() -> None:
    """A person on a large ground, with a tower far away."""
    stage()
    ground = box("ground", (-50, -50, 0), (50, 50, 0))
    ground.data.clear_geometry()
    square = [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)]
    ground.data.from_pydata(square, [], [(0, 1, 2, 3)])
    box("tower", (40, 40, 0), (42, 42, 9))


def thin_wall() -> None:
    """A closed wall 5 mm thick, one 5 cm thick, and two boxes that touch."""
    stage()
    box("thin", (-2, 2, 0), (2, 2.005, 2.5))
    box("thick", (-2, -2.05, 0), (2, -2, 2.5))
    for index in range(2):
        box(f"crate{index}", (2 + index * 0.503, 0, 0), (2.5 + index * 0.503, 2, 2))


def timing() -> None:
    """29.97 frames per second, every second frame."""
    stage()
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 30, 1.001
    scene.frame_step = 2


def comes_late() -> None:
    """An object that renders from the second frame on."""
    stage()
    item = box("guest", (1, 1, 0), (1.5, 1.5, 0.5))
    for frame, hidden in ((1, True), (2, False)):
        item.hide_render = item.hide_viewport = hidden
        item.keyframe_insert("hide_render", frame=frame)
        item.keyframe_insert("hide_viewport", frame=frame)


def pictures() -> None:
    """A packed picture and one whose file is gone."""
    stage()
    for name in ("kept", "lost"):
        image = bpy.data.images.new(name, 4, 4)
        image.filepath_raw = str(FOLDER / f"{name}.png")
        image.save()
        image.source = "FILE"
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        material.node_tree.nodes.new("ShaderNodeTexImage").image = image
        box(name, (1, 1, 0), (1.5, 1.5, 0.5), name)
    bpy.data.images["kept"].pack()
    for name in ("kept", "lost"):
        (FOLDER / f"{name}.png").unlink()


def widgets() -> None:
    """A bone drawn by a mesh that would render."""
    stage()
    widget = box("widget", (2, 2, 0), (2.2, 2.2, 0.2))
    bpy.data.objects["rig"].pose.bones["mixamorig:Hips"].custom_shape = widget


def library() -> None:
    """A person in a collection, for others to link."""
    stage()
    kit = bpy.data.collections.new("kit")
    bpy.context.scene.collection.children.link(kit)
    for name in ("rig", "body"):
        link(bpy.data.objects[name], kit)


def linked() -> None:
    """A person of another file, instanced once, two metres away."""
    open_blank_file()
    bpy.context.scene.frame_end = 3
    with bpy.data.libraries.load(str(FOLDER / "library.blend"), link=True) as (_, wanted):
        wanted.collections = ["kit"]
    guest = bpy.data.objects.new("guest", None)
    guest.instance_type, guest.instance_collection = "COLLECTION", wanted.collections[0]
    guest.location = (2, 0, 0)
    link(guest)
    box("floor", (-4, -4, -0.1), (4, 4, 0))


def missing_library() -> None:
    """The same beside a person of its own, and the other file is gone."""
    stage()
    with bpy.data.libraries.load(str(FOLDER / "library.blend"), link=True) as (_, wanted):
        wanted.collections = ["kit"]
    guest = bpy.data.objects.new("guest", None)
    guest.instance_type, guest.instance_collection = "COLLECTION", wanted.collections[0]
    link(guest)
    bpy.data.libraries[0].filepath = str(FOLDER / "gone.blend")


def heard() -> None:
    """Three access points around the person."""
    stage()
    for index in range(3):
        pose = np.eye(4)
        pose[:3, 3] = index - 1.0, 2.0, 1.5
        add_device(bpy.context.scene, f"ap{index}", "ACCESS_POINT", "any", pose, {})


def scripted() -> None:
    """Code wherever a file can hold some; each would write the file `canary`."""
    stage()
    canary = f"__import__('pathlib').Path({str(FOLDER / 'canary')!r}).write_text('x')"
    text = bpy.data.texts.new("startup.py")
    text.write(
        f"import bpy\n{canary}\nbpy.app.handlers.frame_change_post.append(lambda *_: {canary})"
    )
    text.use_module = True
    material = bpy.data.materials.new("driven")
    material.use_nodes = True
    item = box("crate", (1, 1, 0), (1.5, 1.5, 0.5), "driven")
    curves = [
        item.driver_add("location", 2),
        material.node_tree.driver_add('nodes["Principled BSDF"].inputs[2].default_value'),
        bpy.context.scene.driver_add("audio_volume"),
    ]
    for curve in curves:
        curve.driver.expression = f"{canary} * 0 + 3"
    simple = item.driver_add("location", 0)
    simple.driver.expression = "frame * 0.1"
    bpy.context.scene.render.use_freestyle = True
    styles = bpy.context.view_layer.freestyle_settings
    styles.mode = "SCRIPT"
    styles.modules.new().script = text


#: In this order: later scenes link earlier ones.
SCENES: tuple[Callable[[], None], ...] = (
    alone, modifiers, geometry_nodes, duplicates, visibility, kinds, people_sharing, beast,
    constrained, metres, tiny, tower_moves, far, thin_wall, timing, comes_late, pictures,
    widgets, library, linked, missing_library, heard, scripted,
)  # fmt: skip

#: Scenes that are also exported, to see that the check promises nothing else.
EXPORTED = ("alone", "geometry_nodes", "people_sharing", "linked", "scripted")


def look(name: str, overrides: Overrides) -> dict[str, Any]:
    """The report on the open scene, or its error."""
    try:
        return check_scene(bpy.context.scene, overrides=overrides)
    except AddonError as error:
        return {"error": str(error)}


def main() -> None:
    """Builds, checks and reports."""
    addon_rfgs.register()
    reports: dict[str, Any] = {}
    for build in SCENES:
        name = build.__name__
        build()
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    for build in SCENES:
        name = build.__name__
        open_blend(FOLDER / f"{name}.blend")
        reports[name] = look(name, Overrides())
        for title, said in SAID.items():
            if title.partition("+")[0] == name:
                file = FOLDER / "said.json"
                file.write_text(json.dumps({**said, "label": "said.yaml"}))
                reports[title] = look(name, read_overrides(file))
        if name in EXPORTED:
            export_bundle(bpy.context.scene, FOLDER / name)
    (FOLDER / "reports.json").write_text(json.dumps(reports))
    open_blank_file()


if __name__ == "__main__":
    main()
