# SPDX-License-Identifier: Apache-2.0
"""What a user says about a scene: the YAML file, the options over it, and bad ones."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from dataset_factory.plan.contents import refuse_other_plan, versions
from dataset_factory.plan.job import Job
from dataset_factory.scene.overrides import SceneOptions, overrides_file, read_options
from rfgs_core.errors import RfgsError

MakeJob = Callable[..., Job]

_FILE = """
frames: 1:30          # a range, not 90 in base 60
frame_range: 1:59
drop: [Sky, "Tree*"]
people: on            # a name, not a truth
fps: 29.97
materials: {"Paint*": plasterboard}
cameras: {ring: 6, radius_m: 2}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / "scene.yaml"
    file.write_text(_FILE)
    return file


def test_nothing_said() -> None:
    assert read_options(SceneOptions()) == {}


def test_scalars_are_read_as_meant(config: Path) -> None:
    assert read_options(SceneOptions(scene_config=config)) == {
        "frames": "1:30",
        "frame_range": "1:59",
        "drop": ["Sky", "Tree*"],
        "people": "on",
        "fps": 29.97,
        "materials": [["Paint*", "plasterboard"]],
        "cameras": {"ring": 6, "radius_m": 2},
    }


def test_options_go_before_the_file_and_lists_add_up(config: Path) -> None:
    said = read_options(
        SceneOptions(
            scene_config=config,
            fps=60,
            drop=("Lamp",),
            people=("Anna",),
            material=("Paint*=glass", "a=b=wood"),
            object_material=("Wall=concrete",),
            ring=4,
            room="box",
            bounds=(-1, -2, 0, 1, 2, 3),
        )
    )
    assert said["fps"] == 60 and said["room"] == "box"
    assert said["drop"] == ["Sky", "Tree*", "Lamp"] and said["people"] == ["on", "Anna"]
    assert said["materials"] == [["Paint*", "glass"], ["a=b", "wood"]]
    assert said["object_materials"] == [["Wall", "concrete"]]
    assert said["cameras"] == {"ring": 4, "radius_m": 2}
    assert said["bounds_m"] == [[-1, -2, 0], [1, 2, 3]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fps: 24\nfps: 30\n", ["line 1", "'fps' stands twice"]),
        ("drop: [*Tree]\n", ["alias", "in quotes"]),
        ("- fps\n", ["key: value"]),
        ("fps: [24\n", ["line 2"]),
        ("1: 2\n", ["expected a name before the colon"]),
        ("fps: !!python/object/apply:os.system ['touch canary']\n", ["could not determine"]),
        ("\x00", ["scene.yaml"]),
        ("fps: 1e400\n", ["fps: expected text or a finite number"]),
        ("fps: 9" + "0" * 5000 + "\n", ["no valid YAML"]),
        ("people: !!set {Anna}\n", ["people: expected text"]),
        ("devices: [{position_m: [1, 2, !!timestamp 2020-01-01]}]\n", ["devices: position_m:"]),
        ("drop: &a [x]\npeople: *a\n", ["line 2", "alias 'a'", "in quotes"]),
        ("materials: [[Wall, brick]]\n", ["materials: expected keys and values"]),
        ("drop: " + "[" * 5000, ["no valid YAML"]),
    ],
)
def test_bad_files_get_one_line(tmp_path: Path, text: str, words: list[str]) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(text)
    with pytest.raises(RfgsError) as caught:
        read_options(SceneOptions(scene_config=file))
    message = str(caught.value)
    assert all(word in message for word in words) and "\n" not in message, message
    assert message.startswith(str(file))


def test_whole_numbers_are_decimal(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("fps: 08\ncameras: 010\n")
    said = read_options(SceneOptions(scene_config=tmp_path / "scene.yaml"))
    assert said == {"fps": 8, "cameras": 10}


def test_numbers_without_end_are_refused_as_options() -> None:
    with pytest.raises(RfgsError, match="command line: fps: expected"):
        read_options(SceneOptions(fps=math.nan))
    with pytest.raises(RfgsError, match="command line: bounds_m: expected"):
        read_options(SceneOptions(bounds=(0, 0, 0, 1, 1, math.inf)))


def test_rules_reach_the_scene_in_their_order(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text('materials: {"Wall*": brick, "*": wood}\n')
    said = read_options(SceneOptions(scene_config=file, material=("Wallpaper=glass",)))
    with overrides_file(said) as (_, name):
        handed = json.loads(Path(name).read_text())
    assert list(handed["materials"].items()) == [
        ("Wallpaper", "glass"),
        ("Wall*", "brick"),
        ("*", "wood"),
    ]


def test_rules_in_another_order_are_another_plan(make_job: MakeJob, tmp_path: Path) -> None:
    plans = []
    for rules in ('{"Wall*": brick, "*": wood}', '{"*": wood, "Wall*": brick}'):
        file = tmp_path / "scene.yaml"
        file.write_text(f"materials: {rules}\n")
        said = read_options(SceneOptions(scene_config=file))
        plans.append(replace(make_job(tmp_path).plan, overrides=said))
    stored = json.loads(json.dumps(asdict(plans[0]), sort_keys=True))
    refuse_other_plan(tmp_path, plans[0], stored, versions())
    with pytest.raises(RfgsError, match="was made with overrides = "):
        refuse_other_plan(tmp_path, plans[1], stored, versions())


def test_missing_file_and_missing_sign(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file"):
        read_options(SceneOptions(scene_config=tmp_path / "none.yaml"))
    with pytest.raises(RfgsError, match="expected NAME=MATERIAL"):
        read_options(SceneOptions(material=("concrete",)))
