# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory check`: the table, the JSON, and what a radio adds."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from dataset_factory.scene.report import table

Factory = Callable[..., subprocess.CompletedProcess[str]]
BuildScene = Callable[..., Path]


def test_table_and_json_say_the_same(factory_here: Factory, box_room: Path, tmp_path: Path) -> None:
    file = tmp_path / "check.json"
    answer = factory_here("check", str(box_room), "--radio", "wifi", "--json", str(file))
    assert answer.returncode == 0, answer.stderr
    report = json.loads(file.read_text())
    assert answer.stdout == table(report) + "\n"
    lines = answer.stdout.splitlines()
    for row in report["objects"]:
        (line,) = [line for line in lines if line.startswith(row["name"] + " ")]
        assert f" {row['class']} " in line and row["materials"][0]["radio_material"] in line
    assert len(report["radios"]["wifi"]) == 4
    assert any(line.startswith("guessed devices wifi") for line in lines)
    assert report["scene"]["frames"] == list(range(1, len(report["scene"]["frames"]) + 1))


def test_faults_of_the_scene_and_of_the_radio_end_with_1(
    factory_here: Factory, build_scene: BuildScene, tmp_path: Path
) -> None:
    answer = factory_here("check", str(build_scene(wall="floorboard")), "--radio", "wifi")
    assert answer.returncode == 1
    assert any(
        line.startswith("error") and "50 to 100 GHz" in line for line in answer.stdout.splitlines()
    ), answer.stdout
    still = str(build_scene(moving=False))
    answer = factory_here("check", still, "--radio", "wifi", "--json", "-")
    assert answer.returncode == 1
    (error,) = [row for row in json.loads(answer.stdout)["findings"] if row["severity"] == "error"]
    assert "no moving mesh" in error["message"] and error["remedy"]


def test_packets_that_do_not_fit_a_frame_are_found(factory_here: Factory, box_room: Path) -> None:
    """401 chirps of 0.25 ms are longer than a tenth of a second."""
    answer = factory_here("check", str(box_room), "--radio", "mmwave", "--packets-per-frame", "401")
    assert answer.returncode == 1
    assert "401 samples per frame, 0.25 ms apart, do not fit a frame of 100 ms" in answer.stdout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("pepole: [walker]", ["unknown key 'pepole'", "did you mean 'people'"]),
        ("drop: [wlal*]", ["drop: no object matches 'wlal*'", "did you mean"]),
    ],
)
def test_senseless_overrides_get_one_line(
    box_room: Path, tmp_path: Path, text: str, words: list[str]
) -> None:
    from dataset_factory.scene.blender import Blender
    from dataset_factory.scene.overrides import SceneOptions, label, read_options
    from dataset_factory.scene.report import check_file
    from rfgs_core.errors import RfgsError

    file = tmp_path / "scene.yaml"
    file.write_text(text)
    options = SceneOptions(scene_config=file)
    with pytest.raises(RfgsError) as caught:
        check_file(Blender(box_room), "", read_options(options), label(options), [])
    message = str(caught.value)
    assert message.startswith(f"{file}: ") and all(word in message for word in words), message
    assert "\n" not in message


@pytest.mark.parametrize("damage", ["half", "head", "renamed"])
def test_damaged_files_are_named(
    factory_here: Factory, box_room: Path, tmp_path: Path, damage: str
) -> None:
    content = box_room.read_bytes()
    file = tmp_path / ("scene.obj" if damage == "renamed" else "scene.blend")
    file.write_bytes(
        {
            "half": content[: len(content) // 2],
            "head": content[:60],
            "renamed": b"# OBJ\nv 0 0 0\n",
        }[damage]
    )
    answer = factory_here("check", str(file))
    assert answer.returncode == 2 and not answer.stdout
    errors = [line for line in answer.stderr.splitlines() if line.startswith("error:")]
    assert len(errors) == 1 and str(file) in errors[0], answer.stderr
    assert "Traceback" not in answer.stderr


def test_findings_of_many_objects_share_a_line() -> None:
    same = {"severity": "info", "message": "is hidden, left out", "remedy": ""}
    findings = [{**same, "object": f"tree_{index}"} for index in range(9)]
    scene = {"frames": [1, 2], "frame_start": 1, "frame_end": 2, "fps": 24.0}
    report = {
        "file": "x.blend",
        "scene": {**scene, "unit_scale_m": 1.0, "bounds_m": None},
        "lights": "the scene's own",
        "findings": findings,
        **{name: [] for name in ("objects", "instances", "cameras", "devices", "guesses")},
    }
    (line,) = [line for line in table(report).splitlines() if "left out" in line]
    assert line.split(maxsplit=1)[1].startswith("tree_0, tree_1, tree_2 and 6 more: each is hidden")
