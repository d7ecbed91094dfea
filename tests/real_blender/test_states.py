# SPDX-License-Identifier: Apache-2.0
"""Photographs every state of the tab at two sizes of the window.

PICTURES=docs/blender .venv/bin/pytest -m blender tests/real_blender/test_states.py
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
LIVING_ROOM = ROOT / "blender_scenes" / "living_room_walk.blend"
STATES = ("loaded", "checked", "generating", "done", "imported", "compared", "error")
#: States whose panels stand side by side in the docs, and the size of window they come from.
STRIP, SMALL = ("fresh", "checked", "generating", "done"), (1280, 720)
_GAP_PX, _COLOURS = 12, 160


@pytest.mark.blender
@pytest.mark.slow
@pytest.mark.parametrize("size", [SMALL, (1920, 1080)], ids=["1280", "1920"])
def test_every_state_is_drawn(blender, programs, tmp_path: Path, size: tuple[int, int]) -> None:
    scene, startup = tmp_path / "living_room_walk.blend", tmp_path / "startup.blend"
    shutil.copy(LIVING_ROOM, scene)
    save = f"import bpy; bpy.ops.wm.save_as_mainfile(filepath={str(startup)!r})"
    assert blender.run("-b", "--python-expr", save).returncode == 0
    made = tmp_path / "pictures"
    for blend, arguments in ((startup, ()), (scene, programs)):
        script = HERE / "play_states.py"
        done = play(blender, script, blend, made, *arguments, size=size, timeout=2000)
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
        assert "Traceback" not in done.stdout + done.stderr
    states = json.loads((made / "told.json").read_text())
    assert [state for state, _ in states] == ["Done", "Done", "Failed"]
    assert "900:901" in states[-1][1] and not states[-1][1].startswith("error")
    pictures = {name: _picture(made / f"{name}.png") for name in ("fresh", *STATES)}
    for before, after in itertools.pairwise(STATES):
        assert (pictures[before] != pictures[after]).any(), f"{after} looks like {before}"
    _keep(made, size)


def _picture(file: Path) -> np.ndarray:
    with Image.open(file) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert pixels.std() > 8, f"{file} is blank"
    return pixels


def _keep(made: Path, size: tuple[int, int]) -> None:
    """Puts the picture of the docs where $PICTURES says: panels of the small window."""
    kept = os.environ.get("PICTURES")
    if not kept or size != SMALL:
        return
    folder = ROOT / kept
    folder.mkdir(parents=True, exist_ok=True)
    panels = [Image.open(made / f"{name}_panel.png") for name in STRIP]
    width = sum(panel.width for panel in panels) + _GAP_PX * (len(panels) - 1)
    strip = Image.new("RGB", (width, panels[0].height), "white")
    left = 0
    for panel in panels:
        strip.paste(panel, (left, 0))
        left += panel.width + _GAP_PX
    small = strip.quantize(_COLOURS, dither=Image.Dither.NONE)
    small.save(folder / "states.png", optimize=True)
