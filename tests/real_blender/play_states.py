# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: every state of the tab as a newcomer meets it, panels folded as they come.

Arguments: Python program of the environment, Blender program; without them the fresh state alone.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import bpy

#: What is traced and fitted: enough to have something to look at.
FRAMES, ITERATIONS = "21:25:4", 60
ENDED = ("Done", "Failed", "Stopped")


def play(stage: Any) -> Iterator[float]:
    """From the opened file to a job that fails."""
    stored = stage.part("jobs.preferences").preferences()
    stored.python, stored.blender = stage.arguments or ("", "")
    stage.view.spaces.active.show_region_ui = True
    yield 0.5
    stage.sidebar.active_panel_category = "RF-GS"
    yield 0.5
    if not stage.arguments:
        yield from shoot(stage, "fresh")
        return
    yield from shoot(stage, "loaded")
    bpy.ops.rfgs.check_scene()
    yield from shoot(stage, "checked")
    yield from work(stage, lambda name: shoot(stage, name))
    with stage.override():
        bpy.ops.rfgs.import_result()
    yield 1.0
    yield from shoot(stage, "imported")
    with stage.override():
        bpy.ops.rfgs.compare_gaussians()
    yield from shoot(stage, "compared")
    said = bpy.context.scene.rfgs.jobs
    said.dataset_folder, said.frames = "//elsewhere", "900:901"
    bpy.ops.rfgs.generate_dataset()
    jobs = stage.part("jobs.following").QUEUE.jobs
    yield from stage.wait(lambda: jobs[-1].state in ENDED, "refusal", 120)
    assert jobs[-1].state == "Failed", jobs[-1].message
    yield from shoot(stage, "error")
    (stage.out / "told.json").write_text(json.dumps([(job.state, job.message) for job in jobs]))


def shoot(stage: Any, name: str) -> Iterator[float]:
    """Photographs the window, and the sidebar by itself."""
    yield 0.6  # The list of jobs is drawn twice a second.
    yield from stage.shoot(name)
    yield from stage.shoot(f"{name}_panel", "SIDEBAR")


def work(stage: Any, photograph: Callable[[str], Iterator[float]]) -> Iterator[float]:
    """A dataset and its training, photographed while the one runs and when both are done."""
    said = bpy.context.scene.rfgs.jobs
    said.frames, said.images, said.depth, said.iterations = FRAMES, False, 1, ITERATIONS
    bpy.ops.rfgs.generate_dataset()
    bpy.ops.rfgs.train_gaussians()
    jobs = stage.part("jobs.following").QUEUE.jobs
    traced = ("trace", "done")
    yield from stage.wait(lambda: jobs[0].message.startswith(traced), "tracing", 900)
    yield from photograph("generating")
    yield from stage.wait(lambda: all(job.state in ENDED for job in jobs), "jobs", 900)
    assert [job.state for job in jobs] == ["Done", "Done"], [job.message for job in jobs]
    yield from photograph("done")
