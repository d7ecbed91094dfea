# SPDX-License-Identifier: Apache-2.0
"""Motion capture of others as a scene of ours."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from blender_scenes.__main__ import main
from dataset_factory.scene.bundle import read_bundle
from rfgs_core.example import example_folder

#: From joints to walls, as the builder has it.
MARGIN_M = 1.2


@pytest.mark.parametrize(
    ("recording", "more", "message"),
    [
        ("none.bvh", [], "none.bvh: no such file"),
        ("text.bvh", ["--fps", "0"], "--fps 0: expected 1 to 240"),
        ("text.bvh", ["--repeat", "0"], "--repeat 0: expected 1 to 100"),
    ],
)
def test_what_cannot_be_asked_for_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture, recording: str, more: list[str], message: str
) -> None:
    (tmp_path / "text.bvh").write_text("no motion")
    out = tmp_path / "scene.blend"
    assert main(["recording", str(tmp_path / recording), "--out", str(out), *more]) == 2
    assert message in capsys.readouterr().err and not out.exists()


@pytest.mark.slow
def test_a_pose_that_radio_told_is_played_in_a_room(python, tmp_path: Path) -> None:
    """The motion of the example's run, fitted to Wi-Fi, is a scene that can be traced."""
    recording = next(example_folder().rglob("*.bvh"))
    blend = tmp_path / "scene.blend"
    made = python(
        *("-m", "blender_scenes", "recording", recording, "--out", blend),
        *("--person", "felix", "--fps", "20"),
        must_work=True,
    )
    assert "frames of felix" in made.stdout
    out = tmp_path / "bundle"
    python("-m", "addon_rfgs", "--blend", blend, "export", "--out", out, must_work=True)
    bundle = read_bundle(out)
    lines = recording.read_text().splitlines()
    rows = int(next(line for line in lines if line.startswith("Frames")).split()[1])
    step_s = float(next(line for line in lines if line.startswith("Frame Time")).split()[2])
    assert len(bundle.frames) == 1 + np.ceil(step_s * (rows - 1) * 20)
    assert [row["name"] for row in bundle.instances if row["person"]] == ["felix"]
    places = np.stack([bundle.frame(frame).vertices for frame in bundle.frames])
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    # Upright, feet about the floor, and as far from the walls as the room promises.
    assert abs(low[2]) < 0.15 and 1.4 < high[2] < 2.0
    room = np.array(bundle.info["bounds_m"])
    assert (low[:2] - room[0, :2] > MARGIN_M - 0.35).all()
    assert (room[1, :2] - high[:2] > MARGIN_M - 0.35).all()


@pytest.mark.slow
def test_what_is_no_recording_of_a_person_is_refused(python, tmp_path: Path) -> None:
    recording, out = tmp_path / "text.bvh", tmp_path / "scene.blend"
    recording.write_text("no motion")
    done = python("-m", "blender_scenes", "recording", recording, "--out", out)
    assert done.returncode == 2 and not out.exists()
    assert f"error: {recording}: expected HIERARCHY and MOTION" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_clip_is_played_as_often_as_asked(python, tmp_path: Path) -> None:
    """Somebody who walks half a metre a cycle along x, three times."""
    rows = []
    for share in np.linspace(0.0, 1.0, 11):
        row = [0.1, 0.5 * share, 0.9, 0.0]
        for width in (4, 4, 4, 4, 1, 4, 4, 1, 4, 1, 4, 4, 1):
            row += [1.0, 0.0, 0.0, 0.0] if width == 4 else [0.0]
        rows.append(row)
    clip = tmp_path / "cycle.txt"
    clip.write_text(json.dumps({"Loop": "wrap", "Frames": rows}))
    blend, out = tmp_path / "scene.blend", tmp_path / "bundle"
    python(
        *("-m", "blender_scenes", "recording", clip, "--out", blend, "--repeat", "3"),
        must_work=True,
    )
    python("-m", "addon_rfgs", "--blend", blend, "export", "--out", out, must_work=True)
    bundle = read_bundle(out)
    assert len(bundle.frames) == 31
    first, last = (
        bundle.frame(frame).vertices for frame in bundle.frames[:: len(bundle.frames) - 1]
    )
    way_m = np.linalg.norm((last - first).mean(axis=0)[:2])
    # The way is that of longer or shorter legs.
    assert 1.2 < way_m < 1.8


@pytest.mark.slow
def test_what_is_no_clip_of_a_person_is_refused(python, tmp_path: Path) -> None:
    clip, out = tmp_path / "dog.txt", tmp_path / "scene.blend"
    clip.write_text(json.dumps({"Loop": "wrap", "Frames": [[0.1] * 20] * 3}))
    done = python("-m", "blender_scenes", "recording", clip, "--out", out)
    assert done.returncode == 2 and not out.exists()
    assert f"error: {clip}: expected frames of 44 numbers" in done.stderr
    assert "Traceback" not in done.stderr
