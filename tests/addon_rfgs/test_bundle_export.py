# SPDX-License-Identifier: Apache-2.0
"""Bundles hold what Blender shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle, read_bundle
from rfgs_core.simulate.surface.edges import SHARP, SMOOTH, UNSAID
from rfgs_core.skeleton import JOINTS


@pytest.fixture(scope="module")
def room(scenes: Path) -> Bundle:
    return read_bundle(scenes / "room")


def static_boxes(bundle: Bundle) -> dict[str, np.ndarray]:
    out: dict[str, Any] = {}
    for mesh in bundle.static_meshes():
        out.setdefault(mesh.name.rpartition("__")[0], []).append(mesh.vertices)
    parts = {name: np.concatenate(points) for name, points in out.items()}
    return {name: np.stack([p.min(axis=0), p.max(axis=0)]) for name, p in parts.items()}


@pytest.mark.parametrize("name", ["room", "unit_scale", "mirrored"])
def test_bounding_boxes_agree_with_blender(
    scenes: Path, results: dict[str, Any], name: str
) -> None:
    bundle, boxes = read_bundle(scenes / name), results[name]["boxes"]
    found = static_boxes(bundle)
    moving = bundle.frame(3).vertices
    found["body"] = np.stack([moving.min(axis=0), moving.max(axis=0)])
    assert found.keys() == boxes.keys()
    for key, box in boxes.items():
        np.testing.assert_allclose(found[key], box, atol=2e-5, err_msg=key)


def test_unit_scale_changes_nothing_in_metres(scenes: Path, room: Bundle) -> None:
    other = read_bundle(scenes / "unit_scale")
    np.testing.assert_allclose(other.frame(5).vertices, room.frame(5).vertices, atol=2e-5)
    np.testing.assert_allclose(other.frame(5).joints, room.frame(5).joints, atol=2e-5)
    np.testing.assert_allclose(other.bounds_m, room.bounds_m, atol=2e-5)
    for ours, theirs in zip(other.cameras, room.cameras, strict=True):
        np.testing.assert_allclose(
            ours["world_from_camera"], theirs["world_from_camera"], atol=2e-5
        )
        assert ours["fl_x"] == pytest.approx(theirs["fl_x"])
    np.testing.assert_allclose(
        other.devices[0]["position_m"], room.devices[0]["position_m"], atol=1e-5
    )


def test_golden_bundle(room: Bundle) -> None:
    assert room.info["schema"] == "rfgs-bundle/2" and room.info["blend_name"] == "room"
    assert (room.frames, room.fps) == ([1, 2, 3, 4, 5], 10.0)
    assert [row["name"] for row in room.objects] == ["body", "crate", "floor"]
    assert [row["moving"] for row in room.objects] == [True, False, False]
    person = {"id": 1, "name": "body", "class": "person", "person": True}
    assert room.instances == [{**person, "nominal_surface_m2": None}]
    assert room.topology.rest_vertices.shape == (19 * 8, 3)
    assert room.topology.faces.shape == (19 * 12, 3)
    # The boxes are shaded flat all over, which says nothing of their edges.
    assert np.array_equal(room.topology.edges, np.full((19 * 12, 3), UNSAID))
    device = room.devices[0]
    assert (device["name"], device["radio"], device["role"]) == ("ap", "wifi", "ACCESS_POINT")
    half = np.sqrt(0.5)
    np.testing.assert_allclose(device["quat_wxyz"], [half, 0, 0, half], atol=1e-6)
    # 28 mm on a 36 mm sensor; shifted by 5 % of the width in the second camera.
    assert room.cameras[0]["fl_x"] == pytest.approx(96 * 28 / 36, rel=1e-5)
    assert room.cameras[0]["cx"] == pytest.approx(48) and room.cameras[0]["cy"] == pytest.approx(36)
    assert abs(room.cameras[1]["cx"] - 48) == pytest.approx(0.05 * 96, rel=1e-4)


def test_joints_follow_the_bones(room: Bundle) -> None:
    first, last = room.frame(1), room.frame(5)
    place = dict(zip(JOINTS, first.joints[0], strict=True))
    np.testing.assert_allclose(place["left_elbow"], [0.45, -0.5, 1.4], atol=1e-5)
    np.testing.assert_allclose(place["right_ankle"], [-0.1, -0.5, 0.1], atol=1e-5)
    moved = last.joints[0, JOINTS.index("pelvis")] - first.joints[0, JOINTS.index("pelvis")]
    np.testing.assert_allclose(moved, [0, 1, 0], atol=1e-5)
    assert first.action.tolist() == ["stroll"]


def segment_centre(bundle: Bundle, frame: int, joint: str) -> np.ndarray:
    topology = bundle.topology
    own = topology.faces[topology.segment == JOINTS.index(joint)]
    a, b, c = np.moveaxis(bundle.frame(frame).vertices[own].astype(np.float64), 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area @ (a + b + c) / 3 / area.sum()


def test_segments_move_as_fast_as_their_skin(room: Bundle) -> None:
    velocity = np.stack([room.frame(n).segment_velocity[0] for n in room.frames])
    joints = np.stack([room.frame(n).joints[0] for n in room.frames])
    pelvis, hand = JOINTS.index("pelvis"), JOINTS.index("left_wrist")
    # Trunk and legs glide along +y, one metre in four frames at 10 fps.
    for joint in ("pelvis", "left_ankle", "right_knee", "head"):
        assert velocity[:, JOINTS.index(joint)] == pytest.approx(velocity[:, pelvis], abs=1e-4)
    assert np.abs(velocity[:, pelvis, [0, 2]]).max() < 1e-4
    way_m = 0.1 * 0.5 * (velocity[1:, pelvis, 1] + velocity[:-1, pelvis, 1]).sum()
    assert way_m == pytest.approx(1.0, rel=0.06)
    # Against differences of joints, and of the skin itself, over the frames on either side.
    gliding = (joints[2:, pelvis] - joints[:-2, pelvis]) * 10 / 2
    assert velocity[1:-1, pelvis] == pytest.approx(gliding, abs=0.3)
    before, after = (segment_centre(room, n, "left_wrist") for n in (2, 4))
    assert velocity[2, hand] == pytest.approx((after - before) * 10 / 2, rel=0.1, abs=0.15)
    # The arm that turns is faster than the trunk.
    assert np.linalg.norm(velocity[2, hand] - velocity[2, pelvis]) > 0.5


def test_every_face_knows_its_joint(room: Bundle) -> None:
    topology = room.topology
    counts = np.bincount(topology.segment, minlength=17)
    # Twelve triangles per bone: hips and spine bones share, clavicles go with the thorax.
    assert counts[JOINTS.index("left_knee")] == 12
    assert counts[JOINTS.index("right_wrist")] == 12
    assert counts[JOINTS.index("thorax")] >= 24
    assert counts.sum() == 19 * 12
    centre = topology.rest_vertices[topology.faces[topology.segment == 6]].mean(axis=(0, 1))
    assert centre[0] > 0, "the left ankle is on +x"


def test_marked_edges_reach_the_bundle(scenes: Path) -> None:
    bundle = read_bundle(scenes / "vehicles")
    topology = bundle.topology
    (cart,) = [row["id"] for row in bundle.instances if row["name"] == "cart"]
    of_cart = topology.instance == cart
    # Of the cart's two boxes one has its four upright edges marked, each between two triangles.
    sides = topology.edges[of_cart]
    assert np.bincount(sides.ravel() - UNSAID, minlength=3).tolist() == [36, 28, 8]
    start, end = (
        topology.rest_vertices[corners[of_cart][sides == SHARP]]
        for corners in (topology.faces, np.roll(topology.faces, -1, axis=1))
    )
    assert np.abs(end - start)[:, :2].max() < 1e-6
    assert np.abs(end - start)[:, 2] == pytest.approx(0.4, abs=1e-6)
    assert (topology.edges[~of_cart] == UNSAID).all() and (sides == SMOOTH).any()


def test_materials_are_labelled_or_guessed(scenes: Path) -> None:
    bundle = read_bundle(scenes / "mirrored")
    kinds = {row["source"] or row["name"]: row["radio_material"] for row in bundle.materials}
    assert kinds == {
        "skin": "skin",
        "painted": "wood",
        "Concrete Floor": "concrete",
        "default_plasterboard": "plasterboard",
    }
    guesses = json.loads((scenes / "mirrored" / "guesses.json").read_text())
    assert {"what", "object", "value", "why"} == set(guesses[0])
    assert any(g["object"] == "panel" and g["value"] == "plasterboard" for g in guesses)


def test_negative_scale_keeps_normals_outward(scenes: Path) -> None:
    for name in ("room", "mirrored"):
        mesh = next(m for m in read_bundle(scenes / name).static_meshes() if "crate" in m.name)
        corners = mesh.vertices[mesh.faces].astype(np.float64)
        volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert volume == pytest.approx(0.25, rel=1e-5), name


def test_instances_of_a_collection_are_exported(scenes: Path) -> None:
    boxes = static_boxes(read_bundle(scenes / "instanced"))
    np.testing.assert_allclose(
        boxes["stools1_stool"], [[-0.5, -1.5, 0], [-0.2, -1.2, 0.4]], atol=1e-6
    )
    assert "stools0_stool" in boxes


def test_vehicles_are_one_instance_each_with_a_surface(scenes: Path) -> None:
    bundle = read_bundle(scenes / "vehicles")
    rows = {row["name"]: row for row in bundle.instances}
    assert {row["class"] for row in rows.values()} == {"person", "vehicle"}
    assert rows["cart"]["nominal_surface_m2"] == 7.5
    # 0.6 × 0.4 × 0.5 m: nobody said how large it is, so it counts as its box.
    assert rows["trolley"]["nominal_surface_m2"] == pytest.approx(1.48)
    guesses = json.loads((scenes / "vehicles" / "guesses.json").read_text())
    guessed = [g["object"] for g in guesses if g["what"] == "nominal_surface_m2"]
    assert guessed == ["trolley"]
    parts = [row for row in bundle.objects if row["instance"] == rows["cart"]["id"]]
    assert [row["name"] for row in parts] == ["cart_body", "cart_wheel"]
    assert all(row["moving"] and row["class"] == "vehicle" for row in parts)
    kinds = {row["name"]: row["radio_material"] for row in bundle.materials}
    of_cart = bundle.topology.instance == rows["cart"]["id"]
    names = {bundle.materials[i]["name"] for i in set(bundle.topology.material[of_cart].tolist())}
    assert {kinds[name] for name in names} == {"metal", "wood"}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("topology", ("'crate'", "topology", "frame")),
        ("instanced_moving", ("'stool'", "Make Instances Real")),
        ("still", ("no moving mesh", "1 mm")),
        ("static_moves", ("'crate'", "marked static")),
        ("no_range", ("no frame range",)),
        ("no_mesh", ("no mesh",)),
    ],
)
def test_bad_scenes_are_refused_by_name(
    scenes: Path, results: dict[str, Any], name: str, words: tuple[str, ...]
) -> None:
    error = results[name]["error"]
    assert all(word in error for word in words), error
    assert "\n" not in error
    assert not (scenes / name).exists(), "nothing half-written stays behind"


def test_export_leaves_the_open_file_as_it_was(results: dict[str, Any]) -> None:
    assert all(result["unchanged"] for result in results.values())


def test_scripts_never_run(scenes: Path) -> None:
    assert not (scenes / "scripts_ran").exists()
    guesses = json.loads((scenes / "driver" / "guesses.json").read_text())
    assert any(g["what"] == "driver" and g["object"].startswith("crate") for g in guesses)


@pytest.mark.slow
def test_sixty_frames_of_a_detailed_person_take_seconds(
    scenes: Path, results: dict[str, Any]
) -> None:
    bundle = read_bundle(scenes / "big")
    assert len(bundle.frames) == 60 and len(bundle.topology.rest_vertices) > 14_000
    assert results["big"]["seconds"] < 15
