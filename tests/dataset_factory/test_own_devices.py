# SPDX-License-Identifier: Apache-2.0
"""Devices that somebody put into a file are used, or named before anything starts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Factory = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def sender(box_room: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small room with a transmitter of its own, as the button TX makes it."""
    out = tmp_path_factory.mktemp("own") / "own_room.blend"
    add = ("devices", "add", "transmitter", "--at", "0.5", "0.5", "1.2", "--out", str(out))
    command = [sys.executable, "-m", "addon_rfgs", "--blend", str(box_room), *add]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return out


def test_one_s_own_radio_is_the_default_and_must_be_whole(
    factory_here: Factory, sender: Path, tmp_path: Path
) -> None:
    done = factory_here("generate", str(sender), "--out", str(tmp_path / "new" / "out"))
    assert done.returncode == 2 and done.stderr.endswith(
        f"error: {sender}: no device of radio 'scene' receives; give an Empty the role receiver "
        "or access point\n"
    )
    assert not (tmp_path / "new").exists()


def test_without_devices_of_one_s_own_a_radio_must_be_named(
    factory_here: Factory, box_room: Path, tmp_path: Path
) -> None:
    done = factory_here("generate", str(box_room), "--out", str(tmp_path / "out"))
    assert done.returncode == 2 and "no radio given" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_devices_left_out_are_named_before_anything_starts(
    factory: Factory, sender: Path, tmp_path: Path
) -> None:
    # Bounds that the person leaves end the run soon after.
    tight = ("--radio", "wifi", "--no-images", "--bounds", "0", "0", "0", "1", "1", "1")
    done = factory("generate", str(sender), *tight, "--out", str(tmp_path / "out"))
    lines = done.stderr.splitlines()
    named = "device 'transmitter' of radio 'scene' is left out of wifi; add --radio scene"
    assert lines.index(named) < lines.index(f"{tmp_path / 'out'}: a new dataset")
    assert done.returncode == 2 and not (tmp_path / "out").exists()


def test_the_check_names_them_too(factory_here: Factory, sender: Path) -> None:
    told = factory_here("check", str(sender), "--radio", "wifi")
    assert told.returncode == 0 and "device 'transmitter' of radio 'scene' is left out of wifi" in (
        told.stdout
    )
    usual = factory_here("check", str(sender))
    assert usual.returncode == 1 and "no device of radio 'scene' receives" in usual.stdout
    assert "left out" not in usual.stdout


@pytest.mark.parametrize("frames", ["100:200", "0:2"])
def test_frames_that_a_scene_does_not_have_leave_nothing(
    factory_here: Factory, box_room: Path, tmp_path: Path, frames: str
) -> None:
    for command in ("generate", "plan"):
        asked = ("--radio", "wifi", "--frames", frames, "--out", str(tmp_path / "out"))
        done = factory_here(command, str(box_room), *asked)
        assert done.returncode == 2 and "exporting" not in done.stderr
        assert f"frames: {frames} leaves the range 1:4" in done.stderr
        assert list(tmp_path.iterdir()) == []
