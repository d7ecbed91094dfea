# SPDX-License-Identifier: Apache-2.0
"""Gaussians in a real window: buttons, colours in the Solid view, undo and redo."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "addon_rfgs"))


def saturated(path: Path) -> float:
    """Share of the picture's pixels that are no grey."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), int)
    left = pixels[:, : int(0.7 * pixels.shape[1])]  # the sidebar covers the right
    return float((np.ptp(left, axis=2) > 60).mean())


def test_buttons_colour_and_undo(blender, python, tmp_path: Path) -> None:
    from splat_files import write_run

    blend, run = tmp_path / "tiny.blend", write_run(tmp_path / "run", (1, 2), 3000)
    builder = HERE.parent / "dataset_factory" / "build_tiny_scene.py"
    python(builder, blend, "moving", "concrete", "1.0", must_work=True)
    out = tmp_path / "out"
    done = play(
        blender, HERE / "play_gaussians.py", blend, out, run, size=(1400, 2400), timeout=900
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    seen = json.loads((out / "seen.json").read_text())
    assert seen["imported"] == 2 and seen["boxes"] == 1
    assert seen["at_once"] == ["SOLID", "VERTEX"], "without a second button"
    assert seen["shading"] == ["SOLID", "VERTEX"] and seen["others"]
    assert seen["history"] == [
        ["undo", 2, 0, True],
        ["undo", 2, 0, True],
        ["undo", 0, 0, True],
        ["redo", 2, 0, True],
    ]
    assert seen["ply"] == [["FINISHED", 1, False], ["RUNNING_MODAL", 1, True]]
    assert saturated(out / "points.png") > 0.02, "coloured at once, with a legend"
    assert saturated(out / "solid.png") > 0.02


def test_a_file_that_shows_its_gaussians_opens_on_them(
    blender, tiny_blend: Path, tmp_path: Path
) -> None:
    from splat_files import write_run

    saved, out = tmp_path / "inspect.blend", tmp_path / "out"
    made = blender.rfgs(
        tiny_blend, "import", write_run(tmp_path / "run", (2, 3), 3000), "--out", saved
    )
    assert made.returncode == 0, made.stdout + made.stderr
    done = play(blender, HERE / "play_opening.py", saved, out, size=(1280, 720))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    seen = json.loads((out / "told.json").read_text())
    assert seen["shading"] == ["SOLID", "VERTEX"] and seen["through"] == "CAMERA"
    assert seen["frame"] in (2, 3) and seen["truth"]
    assert saturated(out / "opened.png") > 0.005
