# SPDX-License-Identifier: Apache-2.0
"""The interface in a real window: panels draw, buttons can be clicked."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from leaving_nothing import write_material
from PIL import Image
from two_receivers import write_captures
from window import play

pytestmark = [pytest.mark.blender, pytest.mark.slow]

HERE = Path(__file__).parent
ADDON_TESTS = HERE.parent / "addon_rfgs"
sys.path.insert(0, str(ADDON_TESTS))
from splat_files import write_run  # noqa: E402


@pytest.fixture(scope="module")
def tiny_blend(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box that walks through an empty room."""
    path = tmp_path_factory.mktemp("tiny_blend") / "tiny.blend"
    builder = HERE.parent / "dataset_factory" / "build_tiny_scene.py"
    python(builder, path, "moving", "concrete", "1.0", must_work=True)
    return path


def test_every_panel_is_drawn(blender, tiny_blend: Path, tmp_path: Path) -> None:
    run, dataset = write_run(tmp_path / "run", (1, 3)), tmp_path / "dataset"
    dataset.mkdir()
    (dataset / "dataset.json").write_text("{}")
    script = HERE / "play_panels.py"
    done = play(blender, script, tiny_blend, tmp_path, run, dataset, size=(1400, 2400))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Traceback" not in done.stdout + done.stderr
    drawn, expected = json.loads((tmp_path / "drawn.json").read_text())
    assert drawn == expected and len(drawn) >= 4
    for picture in tmp_path.glob("*.png"):
        with Image.open(picture) as image:
            assert np.asarray(image.convert("L")).std() > 8, f"{picture} is blank"


@pytest.fixture(scope="module")
def room_blend(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor, a crate, an access point and a person who walks."""
    folder = tmp_path_factory.mktemp("room_blend")
    python(ADDON_TESTS / "build_scenes.py", folder, "room", must_work=True)
    return folder / "room.blend"


def test_every_change_can_be_undone(
    blender, programs: tuple[Path, Path], room_blend: Path, tmp_path: Path
) -> None:
    write_material(tmp_path)
    write_run(tmp_path / "run", (1, 3))
    write_captures(tmp_path)
    script = HERE / "play_undo.py"
    done = play(blender, script, room_blend, tmp_path, tmp_path, programs[0], timeout=600)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    told = json.loads((tmp_path / "undo.json").read_text())
    assert told["operators"] == told["undoable"], "every operator that undo knows was walked"
    assert {f"repair {kind}" for kind in told["repairable"]} <= told["walked"].keys()
    for name, script in told["elsewhere"].items():
        text = (HERE / script).read_text()
        assert all(word in text for word in (f"rfgs.{name}", "ed.undo", "ed.redo")), name
    for name, (changed, undone, redone) in told["walked"].items():
        assert changed, f"{name} changes nothing"
        assert not undone, f"{name}, undone: {undone}"
        assert not redone, f"{name}, redone: {redone}"
