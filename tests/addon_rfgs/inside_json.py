# SPDX-License-Identifier: Apache-2.0
"""The add-on's reader of JSON beside `rfgs_core.records`; see `test_inside_blender.py`."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path
from typing import Any

import pytest

from addon_rfgs.errors import AddonError
from addon_rfgs.json_file import Fields, read_json
from rfgs_core.errors import RfgsError
from rfgs_core.records import read_record


@dataclasses.dataclass
class Device:
    name: str
    position_m: list[float]


@dataclasses.dataclass
class Room:
    frames: list[int]
    devices: dict[str, list[Device]]
    known: bool = True


DEVICE = Fields({"name": str, "position_m": [float]})
ROOM = Fields({"frames": [int], "devices": {str: [DEVICE]}}, {"known": bool})
SOUND = {"frames": [1, 2], "devices": {"wifi": [{"name": "a", "position_m": [0, 1.5]}]}}


def changed(**more: Any) -> str:
    return json.dumps({**SOUND, **more})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (changed(), ""),
        (changed(known=False, other=[None]), ""),
        (changed(known=1), "known: expected true or false, found 1"),
        (changed(frames=[1, 2.5]), "frames[1]: expected a whole number, found 2.5"),
        (changed(frames=[True]), "frames[0]: expected a whole number, found True"),
        (changed(frames="1"), "frames: expected a list, found '1'"),
        (
            changed(devices={"wifi": [{"name": 3, "position_m": []}]}),
            ".name: expected text, found 3",
        ),
        (changed(devices={"wifi": [{"name": "a"}]}), "field 'position_m' is missing"),
        ("[]", "expected an object, found a list"),
        ("{", "cannot be read"),
        ("[" * 50_000, "cannot be read"),
        (changed().replace("1.5", "NaN"), "NaN is no JSON"),
        (changed().replace("1.5", "1e999"), "expected a number, found inf"),
    ],
)
def test_both_readers_refuse_the_same(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "a.json"
    file.write_text(text)
    if not said:
        assert read_json(file, ROOM, "make it anew", 10**6) == json.loads(text)
        read_record(file, Room)
        return
    with pytest.raises(AddonError) as caught:
        read_json(file, ROOM, "make it anew", 10**6)
    message = str(caught.value)
    assert said in message and message.startswith(f"{file}: ") and "\n" not in message
    with pytest.raises(RfgsError):
        read_record(file, Room)


def test_what_only_blender_needs_to_refuse(tmp_path: Path) -> None:
    file, pipe = tmp_path / "a.json", tmp_path / "pipe.json"
    file.write_text(json.dumps({"a": 2**70}))
    with pytest.raises(AddonError, match="a: expected a whole number"):
        read_json(file, {str: int}, "make it anew", 10**6)
    file.write_text('{"a": 1, "a": 2}')
    os.mkfifo(pipe)
    for place, said in (
        (file, "stands twice"),
        (pipe, "expected a file"),
        (tmp_path / "b", "read"),
    ):
        with pytest.raises(AddonError, match=said):
            read_json(place, {str: int}, "make it anew", 10**6)
    with pytest.raises(AddonError, match="larger than"):
        read_json(file, {str: int}, "make it anew", 3)
    file.write_bytes(b"\xff\xfe{}")
    with pytest.raises(AddonError, match="cannot be read"):
        read_json(file, {str: int}, "make it anew", 10**6)
