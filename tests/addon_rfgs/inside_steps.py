# SPDX-License-Identifier: Apache-2.0
"""Steps of the tab that unfold by themselves; `test_inside_blender.py` runs this file."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

pytestmark = pytest.mark.usefixtures("registered")


def steps() -> dict[str, bool]:
    """Which steps are unfolded."""
    group = bpy.context.window_manager.rfgs.steps
    return {name: getattr(group, name) for name in type(group).__annotations__}


def test_steps_unfold_once_they_can_be_taken_and_fold_once_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    assert [name for name, unfolded in steps().items() if unfolded] == ["radios"]
    bpy.ops.object.empty_add()
    assert steps()["check"]
    monkeypatch.setattr("addon_rfgs.jobs.panel.environment_path", lambda: "/usr/bin/python3")
    assert not steps()["generate"], "the file is not saved"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert steps()["generate"] and not steps()["train"]
    assert bpy.ops.rfgs.add_device(role="RECEIVER") == {"FINISHED"}
    assert steps()["radios"], "its settings are below"
    bpy.context.view_layer.objects.active = None
    assert not steps()["radios"]
    check = bpy.context.window_manager.rfgs.check
    check.summary = "1 warning"
    check.rows.add().severity = "WARNING"
    assert steps()["check"], "something is to be done"
    check.rows[0].severity = "INFO"
    assert [name for name, unfolded in steps().items() if unfolded] == ["generate"]
    (tmp_path / "rfgs_dataset").mkdir()
    (tmp_path / "rfgs_dataset" / "dataset.json").write_text("{}")
    assert [name for name, unfolded in steps().items() if unfolded] == ["train"]
    (tmp_path / "rfgs_run").mkdir()
    (tmp_path / "rfgs_run" / "point_cloud.ply").touch()
    assert [name for name, unfolded in steps().items() if unfolded] == ["inspect"]


def test_a_step_whose_job_failed_is_seen_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    monkeypatch.setattr("addon_rfgs.jobs.panel.environment_path", lambda: "/usr/bin/python3")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    (tmp_path / "rfgs_dataset").mkdir()
    (tmp_path / "rfgs_dataset" / "dataset.json").write_text("{}")
    for state, unfolded in (("Waiting", False), ("Failed", True), ("Done", False)):
        row = SimpleNamespace(state=state, message="")
        monkeypatch.setattr("addon_rfgs.jobs.panel._last_row", lambda _kind, row=row: row)
        assert steps()["generate"] == unfolded, state


def test_steps_stay_as_the_user_folds_them_and_no_file_knows(tmp_path: Path) -> None:
    bpy.ops.wm.read_homefile(use_empty=True)
    group = bpy.context.window_manager.rfgs.steps
    group.check = group.inspect = True
    group.radios = False
    bpy.ops.object.empty_add()
    bpy.ops.object.delete()
    assert group.check and not group.radios, "whatever can be taken meanwhile"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"), compress=False)
    assert b"inspect\0" not in (tmp_path / "room.blend").read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "room.blend"))
    assert steps()["radios"] and not steps()["check"], "as they come with another file"
