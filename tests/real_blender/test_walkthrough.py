# SPDX-License-Identifier: Apache-2.0
"""Plays docs/blender.md in the living room and makes its pictures.

PICTURES=docs/blender .venv/bin/pytest -m blender tests/real_blender/test_walkthrough.py
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DOCS = ROOT / "docs"
LIVING_ROOM = ROOT / "blender_scenes" / "living_room_walk.blend"
#: Colours of a picture in the docs; a screenshot needs no more.
_COLOURS = 160
_LARGEST_BYTES = 300_000


@pytest.mark.blender
@pytest.mark.slow
def test_the_walkthrough_can_be_walked(
    blender, programs: tuple[Path, Path], tmp_path: Path
) -> None:
    scene = tmp_path / "living_room_walk.blend"
    shutil.copy(LIVING_ROOM, scene)
    made = tmp_path / "pictures"
    script = HERE / "play_walkthrough.py"
    done = play(blender, script, scene, made, *programs, size=(1280, 960), timeout=1500)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    pictures = sorted(made.glob("*.png"))
    assert {file.stem for file in pictures} >= {
        *("overview", "materials", "check", "jobs", "gaussians", "paths", "coverage", "channels")
    }
    kept = os.environ.get("PICTURES")
    for file in pictures:
        with Image.open(file) as image:
            assert np.asarray(image.convert("L")).std() > 8, f"{file} is blank"
            if kept:
                (ROOT / kept).mkdir(parents=True, exist_ok=True)
                small = image.quantize(_COLOURS, dither=Image.Dither.NONE)
                small.save(ROOT / kept / file.name, optimize=True)


def test_pictures_of_the_docs_are_there_and_small() -> None:
    text = (DOCS / "blender.md").read_text("utf-8")
    names = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)
    assert len(names) >= 3
    for name in names:
        assert (DOCS / name).is_file(), name
        assert (DOCS / name).stat().st_size < _LARGEST_BYTES, name
