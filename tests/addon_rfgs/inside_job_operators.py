# SPDX-License-Identifier: Apache-2.0
"""Buttons and commands of jobs; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import bpy
import pytest
from blank_file import open_blank_file
from pretended_jobs import plan, rewrite

import addon_rfgs
from addon_rfgs.cli import run
from addon_rfgs.jobs import following, queue, starting
from addon_rfgs.jobs.checking import CHECK
from addon_rfgs.jobs.plans import (
    GeneratePlan,
)
from addon_rfgs.jobs.process import birth
from addon_rfgs.jobs.record import (
    Record,
    read_record,
    record_file,
    remember,
    remembered,
    write_record,
)

pytest_plugins = ["pretended_jobs"]


def test_resume_runs_the_blender_of_the_preferences(
    program, tmp_path: Path, registered: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLENDER", "/own/blender")
    monkeypatch.setattr(following, "QUEUE", queue.Queue(lambda: tmp_path / "jobs.json"))
    made = GeneratePlan(str(tmp_path / "data"), "/a.blend")
    write_record(Record(made, 0, ""))
    file = record_file(made)
    row = json.loads(file.read_text())
    row["settings"]["blender"] = "/evil/blender"
    rewrite(file, row)
    run(["resume", made.out, "--python", str(program("quick"))])
    assert following.QUEUE.jobs[-1].plan.blender == "/own/blender"


def test_operators_refuse_in_one_line_what_they_cannot_do(registered: None) -> None:
    with pytest.raises(RuntimeError, match="no Python environment is set"):
        bpy.ops.rfgs.test_environment()
    needy = ("generate_dataset", "train_gaussians", "evaluate_run")
    for name in (*needy, "stop_job", "resume_job", "forget_job", "import_result"):
        assert not getattr(bpy.ops.rfgs, name).poll()
    assert not bpy.app.timers.is_registered(following._tick)
    following.follow()
    assert bpy.app.timers.is_registered(following._tick)
    addon_rfgs.unregister()
    assert not bpy.app.timers.is_registered(following._tick)
    addon_rfgs.register()


def test_buttons_of_jobs_say_why_they_cannot_be_pressed(
    registered: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_blank_file()
    with pytest.raises(RuntimeError, match="Save the file first"):
        bpy.ops.rfgs.generate_dataset()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    for name in ("generate_dataset", "train_gaussians"):
        with pytest.raises(RuntimeError, match="or run `rfgs addon install` in it"):
            getattr(bpy.ops.rfgs, name)()
    monkeypatch.setattr("addon_rfgs.jobs.preferences.environment_path", lambda: sys.executable)
    assert bpy.ops.rfgs.generate_dataset.poll()
    monkeypatch.setattr(CHECK, "problems", ["torch is missing"])
    with pytest.raises(RuntimeError, match="torch is missing"):
        bpy.ops.rfgs.train_gaussians()


def test_training_waits_for_a_dataset(registered: None, jobs, tmp_path: Path, monkeypatch) -> None:
    open_blank_file()
    scene = bpy.context.scene
    assert not starting.dataset_to_come(scene), "a file that was never saved has no folder"
    scene.rfgs.jobs.dataset_folder = str(tmp_path / "data")
    monkeypatch.setattr(following, "QUEUE", jobs)
    assert not starting.dataset_to_come(scene)
    jobs.jobs.append(queue.Job(plan(tmp_path, "data"), None))
    assert starting.dataset_to_come(scene), "one is being made"
    jobs.jobs.clear()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "dataset.json").write_text("{}")
    assert starting.dataset_to_come(scene)


def test_a_job_is_forgotten_by_command(
    registered: None, tmp_path: Path, capfd: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed = tmp_path / "jobs.json"
    monkeypatch.setattr(following, "QUEUE", queue.Queue(lambda: listed))
    running, over = plan(tmp_path, "running"), plan(tmp_path, "over")
    write_record(Record(running, os.getpid(), birth(os.getpid())))
    write_record(Record(over, 0, ""))
    remember([record_file(running), record_file(over)], listed)
    assert run(["forget", running.out]) == 2
    assert "not over; stop it first" in capfd.readouterr().err
    assert run(["forget", over.out]) == 0
    assert remembered(listed) == [record_file(running)] and record_file(over).is_file()


def test_devices_of_one_s_own_are_what_is_generated(tmp_path: Path, registered: None) -> None:
    open_blank_file()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    scene = bpy.context.scene
    assert starting.generate_plan(scene).radios == "wifi" and not starting.doing_without(scene)
    bpy.ops.rfgs.add_device(role="ACCESS_POINT")
    device = bpy.context.object
    for radio, meant in (("mmwave", "mmwave"), ("wifi", "wifi"), ("any", "wifi"), ("mine", "wifi")):
        device.rfgs.radio = radio
        assert starting.generate_plan(scene).radios == meant
    bpy.data.objects.remove(device)
    bpy.ops.rfgs.add_device(role="TRANSMITTER")
    assert starting.generate_plan(scene).radios == "scene"
    assert starting.train_plan(scene).radio == "scene" and not starting.doing_without(scene)
    scene.rfgs.jobs.radios = "mmwave, wifi"
    assert starting.generate_plan(scene).arguments().count("--radio=scene") == 0
    assert starting.doing_without(scene) == "left out: transmitter (radio 'scene')"


@pytest.mark.parametrize("named", [True, False])
def test_the_command_names_what_is_left_out_before_the_job_begins(
    program,
    tmp_path: Path,
    registered: None,
    capfd: pytest.CaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    named: bool,
) -> None:
    open_blank_file()
    bpy.ops.rfgs.add_device(role="ACCESS_POINT", location=(1, 0, 1))
    bpy.context.object.name, bpy.context.object.rfgs.radio = "ap", "wifi"
    bpy.ops.rfgs.add_device(role="TRANSMITTER")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    monkeypatch.setattr(following, "QUEUE", queue.Queue(lambda: tmp_path / "jobs.json"))
    out, python = str(tmp_path / "data"), str(program("failing"))
    asked = ["--radio", "wifi"] if named else []
    assert run(["generate", "--out", out, "--python", python, *asked]) == 2
    said = capfd.readouterr()
    left = "transmitter (radio 'scene')" if named else "ap (radio 'wifi')"
    assert f"left out: {left}\n" in said.out and "no wall anywhere" in said.err
    record = read_record(record_file(GeneratePlan(out=out, blend="")))
    assert isinstance(record.plan, GeneratePlan)
    assert record.plan.radios == ("wifi" if named else "scene")
