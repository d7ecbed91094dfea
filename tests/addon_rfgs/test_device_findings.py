# SPDX-License-Identifier: Apache-2.0
"""What the factory shows of the add-on's findings about devices."""

from __future__ import annotations

import json
from pathlib import Path


def test_the_factory_shows_what_devices_need_unless_it_is_told_radios(
    scenes: Path, addon, python
) -> None:
    moved = scenes / "outside.blend"
    add = ("devices", "add", "receiver", "--radio", "wifi", "--at", "-9", "0", "1", "--out", moved)
    assert addon(scenes / "room.blend", *add).returncode == 0
    check = ("-m", "dataset_factory", "check", moved)
    done = python(*check)
    assert done.returncode == 0 and "receiver is a device outside the scene" in done.stdout
    told = json.loads(python(*check, "--radio", "wifi", "--json", "-").stdout)["findings"]
    # Once, by the radio's own check.
    rows = [row for row in told if "receiver" in row["message"] or row["object"] == "receiver"]
    assert [row["severity"] for row in rows] == ["error"]
    assert "device 'receiver' of radio 'wifi'" in rows[0]["message"]
