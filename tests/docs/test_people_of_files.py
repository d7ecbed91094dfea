# SPDX-License-Identifier: Apache-2.0
"""The script of docs/any_blend.md makes scenes of people in glTF and FBX files."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "blender_scenes" / "living_room_walk.blend"
PAGE = (ROOT / "docs" / "any_blend.md").read_text("utf-8")
#: The person of our living room, who walks for 60 frames at 10 per second, as files of others.
_EXPORT = """
import sys
import bpy
source, folder = sys.argv[-2:]
bpy.ops.wm.open_mainfile(filepath=source)
for item in bpy.context.scene.objects:
    item.select_set(item.name in ("person", "person_body"))
bpy.ops.export_scene.gltf(filepath=folder + "/person.glb", use_selection=True)
bpy.ops.export_scene.fbx(filepath=folder + "/person.fbx", use_selection=True)
"""
Python = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def files(python: Python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("people")
    (folder / "export.py").write_text(_EXPORT)
    python(folder / "export.py", SCENE, folder, must_work=True)
    (block,) = (code for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    (folder / "import_person.py").write_text(block)
    return folder


@pytest.mark.parametrize("name", ["person.glb", "person.fbx"])
def test_a_person_is_found_with_joints(python: Python, files: Path, name: str) -> None:
    scene, report = files / f"{name}.blend", files / f"{name}.json"
    python(files / "import_person.py", files / name, scene, "10", must_work=True)
    check = ("-m", "dataset_factory", "check", scene, "--radio", "wifi", "--json", report)
    told = python(*check, must_work=True).stdout
    assert "17 joints known" in told
    found = json.loads(report.read_text())
    assert found["scene"]["fps"] == 10 and len(found["scene"]["frames"]) == 60
    (person,) = found["objects"]
    assert person["class"] == "person" and person["moving"]
    assert person["size_m"][2] == pytest.approx(1.7, abs=0.02)
