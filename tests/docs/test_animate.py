# SPDX-License-Identifier: Apache-2.0
"""The script of the README's moving picture draws every frame of a run."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from rfgs_core.run import Run

ANIMATE = Path(__file__).resolve().parents[2] / "docs" / "animate.py"
Script = Callable[..., subprocess.CompletedProcess[str]]


def test_both_frames_are_drawn(script: Script, small_run: Run, tmp_path: Path) -> None:
    out = tmp_path / "person.webp"
    done = script(ANIMATE, small_run.path, "--out", out)
    assert done.returncode == 0 and "2 frames" in done.stdout
    with Image.open(out) as picture:
        assert picture.n_frames == 2 and picture.size == (2 * (24 + 4 + 24), 2 * 24)
        seen = []
        for frame in range(2):
            picture.seek(frame)
            seen.append(np.asarray(picture.convert("RGB")).astype(int))
            assert picture.info["duration"] == 100
    # The person moves.
    assert np.abs(seen[0] - seen[1]).max() > 20


def test_pictures_of_blender_are_joined_frame_by_frame(
    script: Script, small_run: Run, tmp_path: Path
) -> None:
    out = tmp_path / "person.gif"
    for number, frame in enumerate(small_run.frames):
        picture = Image.new("RGB", (200, 80), (0, 100 + 100 * number, 0))
        picture.save(tmp_path / f"{frame}.png")
    done = script(ANIMATE, small_run.path, "--pictures", tmp_path, "--out", out)
    assert done.returncode == 0, done.stderr
    with Image.open(out) as moving:
        assert moving.n_frames == 2 and moving.size == (200, 80)
        for number in range(2):
            moving.seek(number)
            assert abs(moving.convert("RGB").getpixel((150, 70))[1] - 100 - 100 * number) < 8
    (tmp_path / f"{small_run.frames[1]}.png").unlink()
    done = script(ANIMATE, small_run.path, "--pictures", tmp_path, "--out", out)
    assert done.returncode == 2 and "no such picture" in done.stderr


def test_a_folder_that_is_no_run_is_named(script: Script, tmp_path: Path) -> None:
    done = script(ANIMATE, tmp_path)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines()[-1].startswith("error: ")
