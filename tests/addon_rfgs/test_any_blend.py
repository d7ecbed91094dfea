# SPDX-License-Identifier: Apache-2.0
"""Files that nobody prepared: everything in them is used, guessed, named or refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.scene.bundle import read_bundle

#: Data of others that lie beside the repository.
SHARED = Path(__file__).resolve().parents[3] / "shared"
MESH2MOTION = SHARED / "data" / "blend" / "mesh2motion_jumping_jacks.blend"

Reports = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def folder(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the files, their reports and some bundles."""
    folder = tmp_path_factory.mktemp("any_blend")
    python(Path(__file__).with_name("build_any_blend.py"), folder, must_work=True)
    return folder


@pytest.fixture(scope="module")
def reports(folder: Path) -> Reports:
    return json.loads((folder / "reports.json").read_text())


def objects(report: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in report["objects"]}


def sentences(report: dict[str, Any], severity: str) -> str:
    rows = [row for row in report["findings"] if row["severity"] == severity]
    return "\n".join(f"{row['object']} {row['message']}; {row['remedy']}" for row in rows)


def guessed(report: dict[str, Any], what: str) -> dict[str, str]:
    return {row["object"]: row["value"] for row in report["guesses"] if row["what"] == what}


def test_one_person_and_nothing_else(reports: Reports) -> None:
    report = reports["alone"]
    (person,) = report["instances"]
    assert (person["name"], person["class"], person["joints"]) == ("body", "person", "known")
    low, high = np.array(report["scene"]["bounds_m"])
    inside_low, inside_high = np.array(report["scene"]["movers_m"])
    np.testing.assert_allclose([inside_low - low, high - inside_high][0][:2], 1.5, atol=1e-6)
    assert high[2] - low[2] == pytest.approx(2.5), "room for devices at 2.2 m"
    assert "line of sight" in sentences(report, "info") and not sentences(report, "error")
    assert guessed(report, "camera") and guessed(report, "light") and guessed(report, "bounds")
    assert len(report["cameras"]) == 8 and all(row["made_up"] for row in report["cameras"])


def test_modifiers_and_shape_keys_count_as_rendered(reports: Reports) -> None:
    found = objects(reports["modifiers"])
    assert found["mirror"]["size_m"][0] == pytest.approx(1.0)
    assert (found["mirror"]["triangles"], found["array"]["triangles"]) == (24, 36)
    assert found["array"]["size_m"][0] == pytest.approx(0.3)
    assert found["solid"]["size_m"][2] == pytest.approx(0.1)
    assert found["fine"]["triangles"] == 12 * 4**2, "subdivided as in renders"
    assert found["bulge"]["moving"] and not found["array"]["moving"]


def test_geometry_nodes_bring_their_instances(folder: Path, reports: Reports) -> None:
    found = objects(reports["geometry_nodes"])
    assert sum(name.startswith("studs") for name in found) == 8
    assert sum(name.startswith("grid/model") for name in found) == 8 and "model" in found
    swarm = [row for name, row in found.items() if name.startswith("swarm")]
    assert len(swarm) == 8 and {row["instance"] for row in swarm} == {"swarm"}
    bundle = read_bundle(folder / "geometry_nodes")
    (number,) = [row["id"] for row in bundle.instances if row["name"] == "swarm"]
    faces = bundle.topology.faces[bundle.topology.instance == number]
    assert len(faces) == 8 * 12
    first, last = (bundle.frame(frame).vertices[np.unique(faces)] for frame in (1, 3))
    np.testing.assert_allclose(last - first, np.tile([0, 0, 0.2], (64, 1)), atol=1e-5)


def test_children_repeated_on_vertices_and_faces(reports: Reports) -> None:
    names = list(objects(reports["duplicates"]))
    assert sum(name.startswith("on_vertices/") for name in names) == 8
    assert sum(name.startswith("on_faces/") for name in names) == 6
    assert not {"on_vertices", "on_faces", "on_faces_child"} & set(names), "they do not render"


def test_what_is_hidden_is_named(reports: Reports) -> None:
    report = reports["visibility"]
    assert set(objects(report)) == {"body", "eye_closed", "screen_only", "in_unseen"}
    left_out = sentences(report, "info")
    for name, why in (
        ("no_render", "disabled for renders"),
        ("ignored", "class Ignore"),
        ("in_excluded", "excluded from renders"),
        ("in_unrendered", "excluded from renders"),
        ("the scene", "not another"),
    ):
        assert any(line.startswith(name) and why in line for line in left_out.splitlines()), name


def test_every_kind_of_object_is_converted_or_named(reports: Reports) -> None:
    report = reports["kinds"]
    found = objects(report)
    assert set(found) == {"body", "drop", "ribbon", "sign", "thing"}, "each once"
    assert found["ribbon"]["size_m"] == pytest.approx([0.1, 0.1, 1.0])
    warnings = sentences(report, "warning")
    for name, kind in (
        ("fog", "a volume"),
        ("fur", "hair curves"),
        ("dots", "a point cloud"),
        ("scribble", "grease pencil"),
    ):
        assert f"{name} is {kind}" in warnings
    assert [row["why"] for row in found["thing"]["materials"]] == [
        "material name contains 'oak'",
        "nothing else is known",
    ]


def test_what_is_said_goes_before_what_is_guessed(reports: Reports) -> None:
    report = reports["kinds+said"]
    found = objects(report)
    assert found["ribbon"]["materials"][0]["radio_material"] == "metal"
    assert [row["radio_material"] for row in found["thing"]["materials"]] == ["wood", "glass"]
    assert not found["ribbon"]["materials"][0]["guessed"]
    assert found["sign"]["moving"] and found["sign"]["class"] == "other"
    (device,) = report["devices"]
    half = np.sqrt(0.5)
    np.testing.assert_allclose(device["quat_wxyz"], [half, 0, 0, half], atol=1e-9)


def test_body_and_clothes_are_one_person_and_a_twin_is_another(
    folder: Path, reports: Reports
) -> None:
    report = reports["people_sharing"]
    owner = {name: row["instance"] for name, row in objects(report).items()}
    assert owner == {"body": "body", "shirt": "body", "twin": "twin"}
    joints = {row["name"]: row["joints"] for row in report["instances"]}
    assert joints == {"body": "known", "twin": "unknown"}
    frame = read_bundle(folder / "people_sharing").frame(2)
    assert frame.joints.shape == (2, 17, 3)
    assert np.isfinite(frame.joints[0]).all() and np.isnan(frame.joints[1]).all()


def test_unknown_bones(reports: Reports) -> None:
    assert objects(reports["beast"])["hide"]["class"] == "other"
    report = reports["beast+person"]
    assert objects(report)["hide"]["class"] == "person"
    assert guessed(report, "joints") == {"hide": "unknown"}


def test_what_is_carried_along_moves(reports: Reports) -> None:
    found = objects(reports["constrained"])
    assert all(found[name]["moving"] for name in ("child", "follower", "held"))
    assert found["held"]["instance"] == found["body"]["instance"], "in the person's hand"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("metres", ["body is a person of 182 m", "unit scale", "more than 15 m"]),
        ("tiny", ["everything that moves is smaller than 0.3 m", "unit scale"]),
        ("tower_moves", ["crane moves and is 6 m tall"]),
        ("far", ["100.0 x 100.0 x 9.0 m", "give bounds"]),
        ("far+tight", ["out of the bounds", "narrow the frame range"]),
        ("alone+small", ["room", "smaller than what moves"]),
        ("thin_wall", ["thin has 10 m² of double sheet", "single sheet"]),
        ("comes_late", ["guest appears at frame 2", "topology"]),
        ("missing_library", ["gone.blend is missing", "'guest' came from it"]),
    ],
)
def test_refusals_have_a_remedy(reports: Reports, name: str, words: list[str]) -> None:
    errors = sentences(reports[name], "error")
    assert all(word in errors for word in words), errors
    assert len(errors.splitlines()) == (2 if name == "metres" else 1), errors


@pytest.mark.parametrize(
    "name", ["metres+unit", "far+bounds", "far+drop", "alone+room", "missing_library+dropped"]
)
def test_what_was_refused_is_fine_once_said(reports: Reports, name: str) -> None:
    assert not sentences(reports[name], "error")


def test_bounds_cut_what_is_static(reports: Reports) -> None:
    report = reports["far+bounds"]
    assert set(objects(report)) == {"body", "ground"}
    assert objects(report)["ground"]["size_m"] == pytest.approx([6, 6, 0])
    assert report["scene"]["bounds_m"] == [[-3, -3, -0.1], [3, 3, 2.6]]
    assert "tower is outside the bounds" in sentences(report, "info")


def test_a_room_on_request(reports: Reports) -> None:
    report = reports["alone+room"]
    walls = objects(report)["RFGS room"]
    assert walls["size_m"] == pytest.approx([6, 6, 2.6])
    assert walls["materials"][0]["radio_material"] == "concrete" and not walls["moving"]
    assert "no room" not in sentences(report, "info")


def test_frames_units_and_cameras_on_request(reports: Reports) -> None:
    ring = reports["alone+ring"]
    assert len(ring["cameras"]) == 3 and not guessed(ring, "camera")
    assert ring["scene"]["fps"] == pytest.approx(29.97)
    assert reports["alone+range"]["scene"]["frames"] == [2, 3, 4, 5]
    assert reports["metres+unit"]["scene"]["unit_scale_m"] == pytest.approx(0.01)
    assert reports["timing"]["scene"]["frames"] == [1, 3], "the file's own step"
    assert reports["timing"]["scene"]["fps"] == pytest.approx(30 / 1.001)


def test_devices_are_dropped_as_objects_are(reports: Reports) -> None:
    assert [row["name"] for row in reports["heard"]["devices"]] == ["ap0", "ap1", "ap2"]
    assert [row["name"] for row in reports["heard+fewer"]["devices"]] == ["ap0", "ap1"]


def test_names_that_match_nothing_get_near_ones(reports: Reports) -> None:
    error = reports["far+typo"]["error"]
    assert error == "said.yaml: drop: no object matches 'towr'; did you mean 'tower'?"


def test_a_linked_person_stands_where_it_is_instanced(folder: Path, reports: Reports) -> None:
    assert objects(reports["linked"])["guest/body"]["class"] == "person"
    frame = read_bundle(folder / "linked").frame(1)
    np.testing.assert_allclose(frame.joints[0][0, 0], 2.0, atol=1e-5)
    assert frame.vertices[:, 0].mean() == pytest.approx(2.0, abs=0.1)


def test_missing_pictures_and_bone_shapes_are_named(reports: Reports) -> None:
    warnings = sentences(reports["pictures"], "warning")
    assert "lost.png is missing" in warnings and "kept" not in warnings
    assert "widget" in sentences(reports["widgets"], "info")
    assert "widget" not in objects(reports["widgets"])


def test_code_inside_files_never_runs(folder: Path, reports: Reports, addon) -> None:
    report = reports["scripted"]
    assert "text 'startup.py' asks to run" in sentences(report, "info")
    drivers = guessed(report, "driver")
    assert set(drivers.values()) == {"disabled"} and len(drivers) == 3
    assert {name.partition(":")[0] for name in drivers} == {"crate", "driven", "Scene"}
    # Freestyle runs text blocks when it renders; a refused driver once made Blender hang at exit.
    arguments = ("--out", folder / "truth", "--frames", "1:1", "--cameras", "1")
    done = addon(
        folder / "scripted.blend", "groundtruth", *arguments, "--resolution", "16", "--samples", "1"
    )
    assert done.returncode == 0, done.stderr
    assert (folder / "truth" / "cam00" / "000001.png").is_file()
    assert not (folder / "canary").exists()


def test_a_character_of_others(addon, tmp_path: Path) -> None:
    if not MESH2MOTION.is_file():
        pytest.skip(f"{MESH2MOTION.name} does not lie beside the repository")
    done = addon(MESH2MOTION, "export", "--out", tmp_path / "bundle", "--frames", "1:8:7")
    assert done.returncode == 0, done.stderr
    bundle = read_bundle(tmp_path / "bundle")
    assert [row["name"] for row in bundle.objects] == ["Mannequin.001"]
    assert bundle.instances[0]["person"] and np.isfinite(bundle.frame(8).joints).all()
    low, high = bundle.frame(1).vertices.min(axis=0), bundle.frame(1).vertices.max(axis=0)
    joints = bundle.frame(1).joints[0]
    assert ((joints > low - 0.02) & (joints < high + 0.02)).all(), "joints are inside the body"
    assert {"camera", "bounds", "light", "object_class", "radio_material"} <= {
        row["what"] for row in json.loads((bundle.path / "guesses.json").read_text())
    }
