# SPDX-License-Identifier: Apache-2.0
"""Channels of a link as an image, drawn by `rfgs`; `test_inside_blender.py` runs this file.

$RFGS_RUN is a trained run and $RFGS_PYTHON a Python that has rfgs.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon_rfgs.channels import drawing
from addon_rfgs.channels.image import load_image
from addon_rfgs.cli import run
from addon_rfgs.errors import AddonError
from addon_rfgs.jobs.preferences import ADDON

RUN, PYTHON = os.environ["RFGS_RUN"], os.environ["RFGS_PYTHON"]


@pytest.fixture
def said(empty_scene: Any) -> Any:
    """Settings of an empty scene; preferences that name the environment."""
    return empty_scene.rfgs.channels


def refused(words: str) -> None:
    with pytest.raises(RuntimeError, match=words) as caught:
        bpy.ops.rfgs.show_csi()
    assert len(str(caught.value).strip().splitlines()) == 1
    assert not bpy.data.images


def test_the_link_of_the_panel_becomes_an_image(said: Any) -> None:
    bpy.context.scene.rfgs.gaussians.path = RUN
    said.tx_device = 2
    assert bpy.ops.rfgs.show_csi() == {"FINISHED"}
    (image,) = bpy.data.images
    assert Path(image.filepath) == Path(RUN, "predictions", "link_2.png").resolve()
    assert min(image.size) > 400
    own = bpy.data.images.new("own", 2, 2)
    bpy.ops.rfgs.remove_data()
    assert list(bpy.data.images) == [own]


def test_mistakes_are_told_in_one_line(said: Any, tmp_path: Path) -> None:
    refused("no run is chosen")
    said.run_folder, said.tx_device, said.rx_device = RUN, 7, 8
    refused("wifi measures no link 7→8; it has 0→0, ")
    stored = bpy.context.preferences.addons[ADDON].preferences
    stored.python = ""
    refused("no Python environment is set")
    stored.python = str(tmp_path)
    refused("no bin/python")


def test_it_does_not_wait_for_ever(
    said: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sleeper = tmp_path / "sleeper"
    sleeper.write_text("#!/bin/sh\nexec sleep 60\n")
    sleeper.chmod(0o755)
    said.run_folder = RUN
    bpy.context.preferences.addons[ADDON].preferences.python = str(sleeper)
    monkeypatch.setattr(drawing, "_PATIENCE_S", 0.3)
    refused("no picture after")


def test_the_command_draws_where_it_is_told(
    said: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "link.png"
    common = ["csi", "--run", RUN, "--python", PYTHON, "--out", str(out)]
    assert run([*common, "--rx-device", "1"]) == 0
    assert capfd.readouterr().out.startswith(f"{out}: device 0 to 1, 2 frames; ")
    assert min(load_image(out).size) > 400
    for more, words in (
        (["--tx-device", "-1"], "--tx-device -1: expected 0 to"),
        (["--python", str(tmp_path / "gone")], "no such file"),
    ):
        assert run([*common, *more]) == 2
        assert words in capfd.readouterr().err


def test_only_pictures_become_images(said: Any, tmp_path: Path) -> None:
    with pytest.raises(AddonError, match="no such picture"):
        load_image(tmp_path / "link.png")
    (tmp_path / "link.png").write_bytes(b"\x89PNG not at all")
    with pytest.raises(AddonError, match="not a picture"):
        load_image(tmp_path / "link.png")
    assert not bpy.data.images
    for size in ((8, 4), (16, 2)):
        made = bpy.data.images.new("made", *size)
        made.filepath_raw, made.file_format = str(tmp_path / "link.png"), "PNG"
        made.save()
        bpy.data.images.remove(made)
        assert tuple(load_image(tmp_path / "link.png").size) == size, "read again"
    assert len(bpy.data.images) == 1
