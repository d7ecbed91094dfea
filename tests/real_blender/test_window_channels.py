# SPDX-License-Identifier: Apache-2.0
"""Channels of a link in a real window: drawn in the background, shown, given up."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

from rfgs_core.run import Run

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent


def test_the_button_fills_an_open_image_editor(
    blender, python, programs: tuple[Path, Path], small_run: Run, tmp_path: Path
) -> None:
    blend, out = tmp_path / "tiny.blend", tmp_path / "out"
    builder = HERE.parent / "dataset_factory" / "build_tiny_scene.py"
    python(builder, blend, "moving", "concrete", "1.0", must_work=True)
    done = play(blender, HERE / "play_channels.py", blend, out, programs[0], small_run.path)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    told = json.loads((out / "told.json").read_text())
    assert told["alone"] == [["link_0_1.png"], True, []], "no editor was opened"
    both = ["link_0_1.png", "link_0_2.png"]
    assert told["beside"] == [both, ["link_0_2.png"]]
    assert told["undone"] == [both[:1], both]
    for how in ("given_up", "left", "opened"):
        assert told[how] == [False, True], f"{how}: the program was ended"
    assert len(told["gaps_s"]) > 5 and np.median(told["gaps_s"]) < 1.0, "Blender went on"
    with Image.open(out / "channels.png") as image:
        assert np.asarray(image.convert("L")).std() > 8
