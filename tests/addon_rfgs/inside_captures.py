# SPDX-License-Identifier: Apache-2.0
"""Captures of real radios out of the panel; `test_inside_blender.py` runs this file.

$RFGS_CAPTURES holds `a.csi`, `b.csi` and `radios.yaml`, and $RFGS_PYTHON is a Python that has rfgs.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon_rfgs.cli import run
from addon_rfgs.devices import captured

FOLDER = Path(os.environ["RFGS_CAPTURES"])
BOTH = f"{FOLDER / 'a.csi'}, {FOLDER / 'b.csi'}"


def test_devices_stand_where_the_layout_says(empty_scene: Any, tmp_path: Path) -> None:
    out = tmp_path / "lab"
    values = {"layout": str(FOLDER / "radios.yaml"), "dataset": str(out), "sanitize": True}
    assert bpy.ops.rfgs.import_capture(captures=BOTH, **values) == {"FINISHED"}
    assert (out / "dataset.json").is_file()
    places = {item.name: tuple(round(x, 5) for x in item.location) for item in empty_scene.objects}
    assert places == {"tx": (0.0, 0.0, 1.2), "r1": (3.0, 0.0, 1.2), "r2": (0.0, 3.0, 1.2)}
    assert bpy.data.objects["tx"].rfgs.role == "TRANSMITTER"
    assert bpy.data.objects["r1"].rfgs.role == "RECEIVER"
    assert (
        empty_scene.rfgs.jobs.dataset_folder == str(out)
        and empty_scene.rfgs.jobs.train_radio == "wifi"
    )
    bpy.ops.rfgs.remove_data()
    assert not empty_scene.objects


def test_files_of_the_browser_are_taken(empty_scene: Any, tmp_path: Path) -> None:
    values = {"layout": str(FOLDER / "radios.yaml"), "dataset": str(tmp_path / "lab")}
    files = [{"name": "a.csi"}, {"name": "b.csi"}]
    assert bpy.ops.rfgs.import_capture(directory=f"{FOLDER}/", files=files, **values) == {
        "FINISHED"
    }
    assert len(empty_scene.objects) == 3


def refused(words: str, **values: Any) -> None:
    with pytest.raises(RuntimeError, match=words) as caught:
        bpy.ops.rfgs.import_capture(**values)
    assert len(str(caught.value).strip().splitlines()) == 1
    assert not bpy.data.objects


def test_mistakes_are_told_in_one_line(
    empty_scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = str(tmp_path / "lab")
    refused("no capture is chosen", dataset=out)
    refused("does not tell where its antennas were", captures=str(FOLDER / "a.csi"), dataset=out)
    refused("no such file", captures=str(tmp_path / "none.csi"), dataset=out)
    refused("never saved", captures=BOTH)
    sleeper = tmp_path / "sleeper"
    sleeper.write_text("#!/bin/sh\nexec sleep 60\n")
    sleeper.chmod(0o755)
    monkeypatch.setattr(captured, "_PATIENCE_S", 0.3)
    refused("no dataset after", captures=BOTH, dataset=out, python=str(sleeper))


def test_the_command_saves_the_devices(
    empty_scene: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    blend = tmp_path / "lab.blend"
    command = ["devices", "capture", str(FOLDER / "a.csi"), str(FOLDER / "b.csi")]
    command += ["--layout", str(FOLDER / "radios.yaml"), "--dataset", str(tmp_path / "lab")]
    assert run([*command, "--out", str(blend)]) == 0
    assert "added 3 devices" in capfd.readouterr().out
    with bpy.data.libraries.load(str(blend)) as (found, _):
        assert sorted(found.objects) == ["r1", "r2", "tx"]
