# SPDX-License-Identifier: Apache-2.0
"""Devices, materials and the scene check in a real window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent
LIVING_ROOM = HERE.parents[1] / "blender_scenes" / "living_room_walk.blend"


def bluish(path: Path) -> int:
    """Pixels in the colour of receiving antennas."""
    with Image.open(path) as image:
        red, green, blue = np.moveaxis(np.asarray(image.convert("RGB"), int), 2, 0)
    # Buttons that are switched on are blue too, but darker.
    return int(((blue > 200) & (red < 120) & (green < 180)).sum())


def test_antennas_are_drawn_where_they_are_wanted(blender, tmp_path: Path) -> None:
    done = play(blender, HERE / "play_devices.py", LIVING_ROOM, tmp_path)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    on, off = (bluish(tmp_path / f"overlay_{name}.png") for name in ("on", "off"))
    assert on > 2000 and off < 0.1 * on, (on, off)


def test_materials_and_the_scene_check_in_a_window(blender, tmp_path: Path) -> None:
    script = HERE / "play_authoring.py"
    done = play(blender, script, LIVING_ROOM, tmp_path, size=(1400, 1400))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
