# SPDX-License-Identifier: Apache-2.0
"""The interface in a real window: panels draw, buttons can be clicked."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from leaving_nothing import write_material
from PIL import Image
from window import play

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def tiny_blend(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box that walks through an empty room."""
    path = tmp_path_factory.mktemp("tiny_blend") / "tiny.blend"
    builder = HERE.parent / "dataset_factory" / "build_tiny_scene.py"
    python(builder, path, "moving", "concrete", "1.0", must_work=True)
    return path


def test_every_panel_is_drawn(blender, tiny_blend: Path, tmp_path: Path) -> None:
    done = play(blender, HERE / "play_panels.py", tiny_blend, tmp_path, size=(1400, 2400))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    drawn, expected = json.loads((tmp_path / "drawn.json").read_text())
    assert drawn == expected and len(drawn) >= 4
    for picture in tmp_path.glob("*.png"):
        with Image.open(picture) as image:
            assert np.asarray(image.convert("L")).std() > 8, f"{picture} is blank"


def test_every_change_can_be_undone(blender, tiny_blend: Path, tmp_path: Path) -> None:
    write_material(tmp_path)
    done = play(blender, HERE / "play_undo.py", tiny_blend, tmp_path, tmp_path)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    told = json.loads((tmp_path / "undo.json").read_text())
    # What these two do shows in modifiers and radios, not in what there is.
    quiet = {"update_display", "match_devices"}
    for name, (changed, undone, redone) in told.items():
        assert undone and redone and (changed or name in quiet), (name, changed, undone, redone)
