# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: a dataset, a training and its import, by the buttons of the panel.

Arguments: Python program of the environment, Blender program, folder of the outputs.
"""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """From the first click to Gaussians in the scene; then Blender dies during a second dataset."""
    python, blender, outputs = stage.arguments
    yield from stage.open_tab("RFGS_PT_jobs", "RFGS_PT_generate", "RFGS_PT_train")
    stored = stage.part("jobs.preferences").preferences()
    stored.python, stored.blender = python, blender
    jobs = stage.part("jobs.following").QUEUE
    describe(Path(outputs))
    bpy.context.scene.rfgs.gaussians.path = "/somewhere/else"

    yield from stage.click("rfgs.test_environment")
    check = stage.part("jobs.checking").CHECK
    yield from stage.wait(lambda: bool(check.versions or check.problems), "environment")
    yield from stage.shoot("environment", "SIDEBAR")
    assert not check.problems, check.problems

    stage.gaps_s.clear()
    yield from stage.click("rfgs.generate_dataset")
    yield from stage.click("rfgs.train_gaussians")
    yield from stage.wait(lambda: jobs.jobs[0].message.startswith(("trace", "done")), "tracing")
    yield from stage.shoot("running", "SIDEBAR")
    yield from stage.wait(lambda: jobs.jobs[0].state != "Running", "dataset")
    stored.active_job = 1
    yield from stage.wait(lambda: jobs.jobs[1].state not in ("Waiting", "Running"), "training")
    told = [(job.state, job.message) for job in jobs.jobs]
    assert [state for state, _ in told] == ["Done", "Done"], told
    yield from stage.shoot("done", "SIDEBAR")

    yield from stage.click("rfgs.import_result")
    yield 1.0
    clouds = imported()
    yield from stage.shoot("imported", "VIEW")
    with stage.override():
        bpy.ops.ed.undo()
    yield 0.5
    undone = imported()
    with stage.override():
        bpy.ops.ed.redo()
    yield 0.5
    redone = imported()

    said = bpy.context.scene.rfgs.jobs
    said.dataset_folder, said.workers = str(Path(outputs) / "cut_off"), 1
    yield from stage.click("rfgs.generate_dataset")
    yield from stage.wait(lambda: "trace" in jobs.jobs[-1].message, "tracing once more")
    row = {"clouds": clouds, "undone": undone, "redone": redone, "gaps_s": stage.gaps_s}
    (stage.out / "told.json").write_text(json.dumps(row))
    os.kill(os.getpid(), signal.SIGKILL)


def describe(outputs: Path) -> None:
    """Jobs that are over soon, yet not before the next Blender has started."""
    said = bpy.context.scene.rfgs.jobs
    said.dataset_folder, said.run_folder = str(outputs / "dataset"), str(outputs / "run")
    said.radios, said.frames, said.depth = "wifi_commodity,wifi24", "1:4", 2
    said.images = False
    said.iterations, said.gaussians = 3, 60


def imported() -> list[int]:
    """Points of each cloud in the scene."""
    collection = bpy.data.collections.get("RF-GS Gaussians")
    items = collection.all_objects if collection else []
    return sorted(len(item.data.vertices) for item in items if item.type == "MESH")
