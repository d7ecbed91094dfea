# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene check and its repairs inside Blender; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from build_scenes import box, still
from mathutils import Vector

from addon_rfgs.check import repairs, scene_repairs
from addon_rfgs.cli import open_blend, run
from addon_rfgs.errors import AddonError
from addon_rfgs.scene import check
from addon_rfgs.scene.bodies import inside_out, seams, welded
from addon_rfgs.scene.findings import Finding

pytestmark = pytest.mark.usefixtures("in_room")


def found(kind: str) -> list[Finding]:
    bpy.context.view_layer.update()
    return [row for row in repairs.findings(bpy.context.scene) if row.kind == kind]


def repaired(kind: str) -> str:
    """Repairs the one finding of a kind by the button; returns what it was about."""
    rows = bpy.context.window_manager.rfgs.check.rows
    assert bpy.ops.rfgs.check_scene() == {"FINISHED"}
    index = next(index for index, row in enumerate(rows) if row.kind == kind)
    assert rows[index].repairable
    name = rows[index].object
    assert bpy.ops.rfgs.repair_finding(index=index) == {"FINISHED"}
    assert kind not in {row.kind for row in rows}, [row.message for row in rows]
    assert not found(kind)
    return name


def cube(size: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices [8, 3] and triangles [12, 3] of a closed box from 0 to `size`."""
    points = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return size * points, np.array([t for q in quads for t in (q[:3], (q[0], *q[2:]))])


def test_a_good_scene_has_nothing_to_repair() -> None:
    rows = repairs.findings(bpy.context.scene)
    assert {row.severity for row in rows} <= {"info"}
    assert not [row for row in rows if repairs.repairable(bpy.context.scene, row)]


def test_a_person_in_centimetres() -> None:
    scene = bpy.context.scene
    parent = bpy.data.objects.new("centimetres", None)
    scene.collection.objects.link(parent)
    for item in scene.objects:
        if item.parent is None and item != parent:
            item.parent = parent
    parent.scale = (100, 100, 100)
    bpy.context.view_layer.update()
    assert {row.severity for row in found("unit_scale")} == {"error"}
    assert scene_repairs.likely_unit(scene) == 0.01
    repaired("unit_scale")
    assert scene.unit_settings.scale_length == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("scale", "severity"), [(0.2, "error"), (0.3, "warning"), (1.6, "warning")]
)
def test_a_person_of_an_unlikely_size_is_named(scale: float, severity: str) -> None:
    """With an arm overhead a person of 0.44 m is half a metre long, as a small child is."""
    bpy.data.objects["rig"].scale = (scale,) * 3
    bpy.context.view_layer.update()
    rows = [row for row in repairs.findings(bpy.context.scene) if "is a person of" in row.message]
    (row,) = rows
    assert (row.severity, row.object) == (severity, "body") and "unit scale" in row.remedy
    # Only the unit of what cannot be a person is put right by a button.
    assert repairs.repairable(bpy.context.scene, row) == (severity == "error")


def test_nothing_tells_the_unit_where_nothing_moves() -> None:
    still()
    with pytest.raises(AddonError, match="nothing moves"):
        scene_repairs.likely_unit(bpy.context.scene)
    (row,) = found("no_motion")
    assert row.severity == "error" and not repairs.repairable(bpy.context.scene, row)
    with pytest.raises(AddonError, match="no safe repair"):
        repairs.repair(bpy.context.scene, row)


@pytest.mark.parametrize("cuts", [0, 2])
@pytest.mark.parametrize("turned", [False, True])
def test_a_thin_wall_becomes_one_sheet(cuts: int, turned: bool) -> None:
    wall = box("wall", (-1.5, 1.9, 0), (1.5, 1.906, 2.5), "Brick")
    bpy.context.view_layer.objects.active = wall
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    if cuts:
        bpy.ops.mesh.subdivide(number_cuts=cuts)
    if turned:
        bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")
    wall.rotation_euler, wall.scale = (0, 0, 0.3), (1, 1, 0.9)
    assert repaired("double_sheet") == "wall"
    area = sum(face.area for face in wall.data.polygons)
    assert area == pytest.approx(3.0 * 2.5), "one side of it is left, whole"
    normals = np.array([face.normal for face in wall.data.polygons])
    np.testing.assert_allclose(np.abs(normals @ normals[0]), 1.0, atol=1e-5)


def test_solidified_walls_lose_the_modifier() -> None:
    wall = box("wall", (-1.5, 1.9, 0), (1.5, 1.9, 2.5), "Brick")
    wall.data.clear_geometry()
    corners = [(-1.5, 1.9, 0), (1.5, 1.9, 0), (1.5, 1.9, 2.5), (-1.5, 1.9, 2.5)]
    wall.data.from_pydata(corners, [], [(0, 1, 2, 3)])
    wall.modifiers.new("thick", "SOLIDIFY").thickness = 0.005
    repaired("double_sheet")
    assert not wall.modifiers and len(wall.data.polygons) == 1


def test_shared_meshes_are_left_alone() -> None:
    wall = box("wall", (-1.5, 1.9, 0), (1.5, 1.906, 2.5), "Brick")
    twin = bpy.data.objects.new("twin", wall.data)
    row = Finding("error", "wall", "", "", "double_sheet")
    with pytest.raises(AddonError, match="shared by 2 objects"):
        repairs.repair(bpy.context.scene, row)
    assert len(twin.data.polygons) == 6


def test_split_people_are_merged() -> None:
    body = bpy.data.objects["body"]
    whole = len(body.data.vertices)
    weights = {group.group for group in body.data.vertices[0].groups}
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.edge_split()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(body.data.vertices) == 3 * whole
    # Seams as of textures, which the tracer closes itself, are no openings.
    assert not found("split_body") and not found("open_body")
    rng = np.random.default_rng(2)
    for vertex in body.data.vertices:
        vertex.co += Vector(rng.uniform(-2e-5, 2e-5, 3))
    (row,) = found("split_body")
    assert row.severity == "warning" and "merge" in row.remedy
    assert repaired("split_body") == "body"
    assert len(body.data.vertices) == whole
    assert {g.group for g in body.data.vertices[0].groups} == weights, "still skinned"
    assert not found("open_body")


def test_holes_are_named_and_stay() -> None:
    body = bpy.data.objects["body"]
    body.data.polygons[0].select = True
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type="FACE")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    body.data.polygons[0].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="ONLY_FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    (row,) = found("open_body")
    assert "4 open edges and 0 of more" in row.message
    assert not repairs.repairable(bpy.context.scene, row)


def test_people_inside_out_are_turned() -> None:
    bpy.data.objects["body"].data.flip_normals()
    assert repaired("inside_out") == "body"


def test_edges_of_a_box_count_as_they_should() -> None:
    points, faces = cube(1.0)
    assert seams(faces) == (0, 0, 18)
    assert inside_out(points, faces) != inside_out(points, faces[:, ::-1])
    alone = np.arange(36).reshape(12, 3)
    assert seams(alone) == (36, 0, 36)
    assert seams(welded(points[faces].reshape(-1, 3), alone)) == (0, 0, 18)
    assert seams(np.concatenate([faces, [[0, 1, 6]]]))[1] == 2, "an edge and a diagonal"


def test_materials_out_of_band_become_their_guess_where_that_helps() -> None:
    floor = bpy.data.materials["Concrete Floor"].rfgs
    floor.radio_material = "floorboard"
    (row,) = found("material_band")
    assert (row.object, row.material) == ("floor", "Concrete Floor")
    assert "50–100 GHz" in row.message and "radio 'wifi' uses 5.72–5.88 GHz" in row.message
    repaired("material_band")
    assert floor.radio_material == "concrete"
    # Plywood is not known at 60 GHz, and what it is called is no help.
    paint = bpy.data.materials["painted"]
    paint.name, paint.rfgs.radio_material = "plywood", "plywood"
    bpy.context.scene.rfgs.materials.carrier_ghz = 60.0
    (row,) = found("material_band")
    assert "the carrier uses 60 GHz" in row.message
    assert not repairs.repairable(bpy.context.scene, row)


def test_devices_inside_furniture_are_moved_out() -> None:
    point = bpy.data.objects["ap"]
    point.location = (1.6, 1.2, 0.3)
    (row,) = found("device_inside")
    assert row.object == "ap" and "'crate'" in row.message
    repaired("device_inside")
    # The crate reaches from 1.2 to 1.7 m: the nearest way out is along x.
    assert tuple(point.location)[1:] == pytest.approx((1.2, 0.3))
    assert 1.7 < point.location.x <= 1.8 + 1e-6


def test_devices_outside_are_moved_in() -> None:
    point = bpy.data.objects["ap"]
    point.location = (-5, 1, 1.2)
    repaired("device_outside")
    assert tuple(point.location) == pytest.approx((-1.8, 1, 1.2), abs=1e-5)


def test_no_place_is_no_place() -> None:
    bounds = np.array([[-10.0] * 3, [10.0] * 3])
    points, faces = cube(10.0)
    mesh = points - 5.0, faces
    with pytest.raises(AddonError, match="no free place"):
        scene_repairs.free_place(np.zeros(3), bounds, [mesh])
    near = scene_repairs.free_place(np.array([4.72, 0.1, 0.2]), bounds, [mesh])
    np.testing.assert_allclose(near, [5.02, 0.1, 0.2], atol=1e-9)


def test_devices_of_one_radio_become_alike() -> None:
    for index in range(2):
        bpy.ops.rfgs.add_device(role="ACCESS_POINT", location=(index - 0.5, -1, 1.2))
    changed = bpy.context.view_layer.objects.active
    changed.rfgs.rf.rx_cols = 5
    (row,) = found("devices_differ")
    assert row.object == changed.name and "rx_cols" in row.message
    repaired("devices_differ")
    assert changed.rfgs.rf.rx_cols == 8


def test_too_many_faces(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not found("many_faces")
    monkeypatch.setattr(check, "MOST_MOVING", 100)
    monkeypatch.setattr(check, "MOST_STATIC", 20)
    assert {row.object for row in found("many_faces")} == {"body", "crate"}


def test_a_scene_that_cannot_be_looked_at_is_in_the_list() -> None:
    bpy.context.scene.frame_end = 1
    bpy.ops.rfgs.check_scene()
    (row,) = bpy.context.window_manager.rfgs.check.rows
    assert row.severity == "ERROR" and "no frame range" in row.message and row.remedy
    with pytest.raises(RuntimeError, match="no object 'the scene'"):
        bpy.ops.rfgs.select_finding()


def test_select_goes_to_what_is_meant() -> None:
    point = bpy.data.objects["ap"]
    point.location = (-5, 1, 1.2)
    bpy.ops.rfgs.check_scene()
    rows = bpy.context.window_manager.rfgs.check.rows
    index = next(i for i, row in enumerate(rows) if row.kind == "device_outside")
    bpy.ops.rfgs.select_finding(index=index)
    assert bpy.context.view_layer.objects.active == point and point.select_get()
    assert [item.name for item in bpy.context.selected_objects] == ["ap"]


def test_select_by_command(tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    bpy.data.objects["ap"].location = (-5, 1, 1.2)
    out = tmp_path / "selected.blend"
    assert run(["check"]) == 0
    lines = capfd.readouterr().out.splitlines()
    number = 1 + next(i for i, line in enumerate(lines) if "outside the scene" in line)
    assert run(["check", "--select", str(number), "--save", str(out)]) == 0
    open_blend(out)
    assert [item.name for item in bpy.context.selected_objects] == ["ap"]
    assert bpy.context.view_layer.objects.active.name == "ap"
    capfd.readouterr()
    for words in (["0", "--save", str(out)], ["99", "--save", str(out)], ["1"]):
        assert run(["check", "--select", *words]) == 2
        assert capfd.readouterr().err.count("\n") == 1


def test_findings_are_not_saved(tmp_path: Path) -> None:
    bpy.data.objects["ap"].location = (-5, 1, 1.2)
    bpy.ops.rfgs.check_scene()
    assert len(bpy.context.window_manager.rfgs.check.rows) > 0
    path = tmp_path / "checked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    assert b"device_outside" not in path.read_bytes()
    open_blend(path)
    assert len(bpy.context.window_manager.rfgs.check.rows) == 0


def test_undo_makes_the_list_old_until_it_is_made_again() -> None:
    check, point = bpy.context.window_manager.rfgs.check, bpy.data.objects["ap"]
    point.location = (-5, 1, 1.2)
    bpy.ops.ed.undo_push(message="outside")
    point.location = (0, 0, 1.2)
    bpy.ops.ed.undo_push(message="inside")
    bpy.ops.ed.undo()
    assert not check.outdated, "nothing was checked yet"
    bpy.context.view_layer.update()
    bpy.ops.rfgs.check_scene()
    index = [row.kind for row in check.rows].index("device_outside")
    assert not check.outdated and bpy.ops.rfgs.repair_finding.poll()
    bpy.ops.ed.redo()
    assert check.outdated and bpy.ops.rfgs.select_finding.poll()
    with pytest.raises(RuntimeError, match="Undo or Redo changed the scene; check it again"):
        bpy.ops.rfgs.repair_finding(index=index)
    assert tuple(bpy.data.objects["ap"].location) == pytest.approx((0, 0, 1.2)), "left as it is"
    bpy.ops.rfgs.check_scene()
    assert not check.outdated and "device_outside" not in [row.kind for row in check.rows]


def test_fix_by_command(tmp_path: Path, capfd: pytest.CaptureFixture) -> None:
    bpy.data.objects["ap"].location = (-5, 1, 1.2)
    bpy.data.objects["body"].data.flip_normals()
    out = tmp_path / "fixed.blend"
    assert run(["check"]) == 0
    assert "warning: object 'ap' is a device outside the scene" in capfd.readouterr().out
    assert run(["fix", "inside_out", "--out", str(out)]) == 0
    said = capfd.readouterr().out
    assert "fixed: turned the normals of body outwards" in said
    assert "left: warning: object 'ap'" in said
    assert run(["fix", "--out", str(out)]) == 0
    said = capfd.readouterr().out
    assert "fixed: moved ap by 3.2" in said and "left: warning" not in said
    open_blend(out)
    assert not found("device_outside")
    assert run(["fix", "everything", "--out", str(tmp_path / "never.blend")]) == 2
    assert "unknown kind 'everything'" in capfd.readouterr().err
    assert not (tmp_path / "never.blend").exists()


def test_devices_that_a_dataset_does_without_are_named() -> None:
    scene = bpy.context.scene
    assert not found("device_left_out"), "the access point of radio 'wifi' is what is traced"
    bpy.ops.rfgs.add_device(role="TRANSMITTER", location=(-1.0, -1.0, 1.2))
    (row,) = found("device_left_out")
    assert row.object == "ap" and "radio 'wifi', left out of a dataset with scene" in row.message
    (row,) = found("devices_silent")
    assert row.message == "no device of radio 'scene' receives"
    bpy.ops.rfgs.add_device(role="RECEIVER", location=(1.0, -1.0, 1.2))
    assert not found("devices_silent")
    scene.rfgs.jobs.radios = "wifi"
    assert [row.object for row in found("device_left_out")] == ["receiver", "transmitter"]
    scene.rfgs.jobs.radios = "wifi, scene"
    assert not found("device_left_out")
    bpy.ops.rfgs.check_scene()
    assert "warning" not in bpy.context.window_manager.rfgs.check.summary


def test_devices_for_any_radio_stand_in_corners_only() -> None:
    scene = bpy.context.scene
    bpy.data.objects["ap"].rfgs.radio = "any"
    for radios, expected in (("mmwave", 0), ("uwb", 1), ("uwb,mmwave", 0), ("lab.yaml", 0)):
        scene.rfgs.jobs.radios = radios
        assert len(found("device_left_out")) == expected, radios
    bpy.data.objects["ap"].rfgs.radio = "lab"
    assert not found("device_left_out"), "a file may describe it"
    scene.rfgs.jobs.radios = "uwb"
    assert len(found("device_left_out")) == 1
