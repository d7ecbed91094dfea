# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

from blender_scenes.catalogue import FOLDER, scenes

Run = Callable[..., subprocess.CompletedProcess[str]]


def test_catalogue_lists_exactly_the_files_there_are() -> None:
    known = scenes()
    assert {scene.file for scene in known.values()} == {p.name for p in FOLDER.glob("*.blend")}
    for name, scene in known.items():
        assert scene.name == name
        assert (FOLDER / f"{name}.py").is_file()
        assert scene.path.stat().st_size < 3e6


def test_catalogue_states_the_frames_of_the_file(walk: SimpleNamespace) -> None:
    scene = scenes()["living_room_walk"]
    assert walk.report["frames"] == [scene.frame_start, scene.frame_end, scene.fps]


def test_listing_needs_no_blender(python: Run) -> None:
    check = (
        "import sys; from blender_scenes.__main__ import main; main(['list']); "
        "assert not {'bpy', 'anny', 'torch'} & set(sys.modules)"
    )
    done = python("-c", check)
    assert done.returncode == 0, done.stderr
    assert "living_room_walk  1:60 at 10 fps" in done.stdout


def test_wrong_names_get_one_clear_line(python: Run, tmp_path: Path) -> None:
    done = python("-m", "blender_scenes", "build", "castle")
    assert done.returncode == 2
    assert done.stderr == f"error: no scene 'castle'; there are: {', '.join(scenes())}\n"
    done = python("-m", "blender_scenes", "build", "--out", tmp_path / "absent" / "a.blend")
    assert done.returncode == 2
    assert "no such folder" in done.stderr and len(done.stderr.splitlines()) == 1
    done = python("-m", "blender_scenes", "bodies", "--out", tmp_path / "absent" / "a.npz")
    assert done.returncode == 2
    assert "no such folder" in done.stderr and len(done.stderr.splitlines()) == 1
