# SPDX-License-Identifier: Apache-2.0
"""Devices that somebody put into a file are used, or named before anything starts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rfgs_core.dataset import open_dataset

Factory = Callable[..., subprocess.CompletedProcess[str]]


def with_device(blend: Path, out: Path, role: str, *more: str) -> Path:
    """A copy of a file with one device more, as the buttons of the panel make it."""
    add = ("devices", "add", role, *more, "--out", str(out))
    command = [sys.executable, "-m", "addon_rfgs", "--blend", str(blend), *add]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return out


@pytest.fixture(scope="module")
def sender(box_room: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small room with a transmitter of its own, as the button TX makes it."""
    out = tmp_path_factory.mktemp("own") / "own_room.blend"
    return with_device(box_room, out, "transmitter", "--at", "0.5", "0.5", "1.2")


@pytest.fixture(scope="module")
def pair(sender: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room with a transmitter and a receiver of its own, and a box of a preset."""
    folder = tmp_path_factory.mktemp("pair")
    heard = with_device(sender, folder / "pair.blend", "receiver", "--at", "2.5", "0.5", "1.2")
    box = ("--radio", "wifi", "--name", "box", "--at", "2.5", "2.5", "1.2")
    return with_device(heard, folder / "pair.blend", "access-point", *box)


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
    assert done.returncode == 2 and "no radio given, and the scene has no devices" in done.stderr
    assert list(tmp_path.iterdir()) == []
    box = ("--radio", "wifi", "--at", "0.5", "0.5", "1.2")
    preset = with_device(box_room, tmp_path / "preset.blend", "access-point", *box)
    done = factory_here("generate", str(preset), "--out", str(tmp_path / "out"))
    assert done.returncode == 2 and done.stderr.endswith(
        "no radio given, and the scene has devices of the radio 'wifi'; add --radio wifi\n"
    )


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


def test_one_s_own_devices_are_traced_unless_a_radio_is_named(
    factory_here: Factory, pair: Path, tmp_path: Path
) -> None:
    out = tmp_path / "data"
    asked = ("--frames", "1", "--depth", "1", "--no-images", "--workers", "1", "--out", str(out))
    assert factory_here("generate", str(pair), *asked).returncode == 0
    sequence = open_dataset(out).sequence()
    assert list(sequence.radios) == ["scene"]
    assert [device.name for device in sequence.devices("scene")] == ["receiver", "transmitter"]
    told = factory_here("check", str(pair))
    assert told.returncode == 0
    assert "device 'box' of radio 'wifi' is left out of scene; add --radio wifi" in told.stdout


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
