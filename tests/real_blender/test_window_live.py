# SPDX-License-Identifier: Apache-2.0
"""A stream of `rfgs live` watched in a real window: its Gaussians move, and Blender goes on."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from window import play

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent
#: What the docs show of the window: who is followed, and the panel.
PICTURE_PX = (320, 0, 1280, 560)
SCENE = HERE.parents[1] / "blender_scenes" / "living_room_walk.blend"


@pytest.fixture
def feed(python, programs: tuple[Path, Path], tmp_path: Path) -> Iterator[str]:
    """Port of a walk that is replayed slowly enough for the window to open meanwhile."""
    walk = ["living_room_walk", "--tracer", "fast", "--radio", "mmwave", "--depth", "1"]
    rest = ["--frames", "10:60", "--no-images", "--out", tmp_path / "walk"]
    python("-m", "dataset_factory", "generate", *walk, *rest, must_work=True)
    command = [programs[0], "-m", "rfgs_core.cli", "live", "--replay", tmp_path / "walk"]
    command += ["--rate", "0.1", "--no-view", "--whole-fit-s", "0", "--feed-port", "0"]
    with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as live:
        try:
            assert live.stdout is not None
            lines = iter(live.stdout.readline, "")
            yield next(at[1] for line in lines if (at := re.search(r"port (\d+)", line)))
        finally:
            live.terminate()


def test_a_stream_moves_the_cloud_of_a_window(blender, feed: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = play(blender, HERE / "play_live.py", SCENE, out, feed, size=(1280, 900))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    told = json.loads((out / "told.json").read_text())
    assert re.match(r"400 Gaussians, \d+ updates in \d+\.\d s$", told["line"])
    assert told["moved_m"] > 0.1, "the person walks"
    assert told["count"] == 400 and told["stays"] and not told["still_sent"]
    assert told["stopped"].startswith("Stopped: 400 Gaussians")
    assert np.median(told["gaps_s"]) < 0.5, "Blender went on"
    with Image.open(out / "following.png") as image:
        pixels = np.asarray(image.convert("RGB"), int)[:, : int(0.6 * image.width)]
        if wanted := os.environ.get("PICTURES"):
            image.crop(PICTURE_PX).save(Path(wanted) / "live.png", optimize=True)
    assert (np.ptp(pixels, axis=2) > 60).mean() > 0.0005, "coloured"
