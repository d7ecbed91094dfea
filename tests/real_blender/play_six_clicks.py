# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: from a file without radios to Gaussians in the view, by the mouse alone.

Every setting stays as it is. Arguments: Python program of the environment, Blender program.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """The button of a preset and the preset, a dataset, a training and its Gaussians."""
    stored = stage.part("jobs.preferences").preferences()
    # As `rfgs addon install` leaves them.
    stored.python, stored.blender = stage.arguments
    steps = ("devices", "check", "generate", "train", "jobs", "gaussians")
    yield from stage.open_tab(*(f"RFGS_PT_{name}" for name in steps))
    yield from stage.choose_first(above="rfgs.import_devices")
    placed = sorted(item.rfgs.radio for item in bpy.data.objects if item.rfgs.role != "NONE")
    yield from stage.shoot("placed")

    jobs = stage.part("jobs.following").QUEUE
    stage.forget_places()
    yield from stage.click("rfgs.generate_dataset")
    yield from stage.click("rfgs.train_gaussians")
    yield from stage.shoot("under_way")
    yield from stage.wait(lambda: jobs.jobs[0].state not in ("Waiting", "Running"), "dataset", 900)
    yield from stage.wait(lambda: jobs.jobs[1].state not in ("Waiting", "Running"), "training", 900)
    told = [(job.state, job.message) for job in jobs.jobs]
    assert [state for state, _ in told] == ["Done", "Done"], told

    stage.forget_places()
    yield from stage.click("rfgs.import_result")
    yield 2.0
    yield from stage.shoot("gaussians")
    clouds = [item for item in bpy.data.collections["RF-GS Gaussians"].all_objects]
    row = {
        "placed": placed,
        "clouds": [len(item.data.vertices) for item in clouds if item.type == "MESH"],
        "coloured": stage.view.spaces.active.shading.color_type,
    }
    (stage.out / "told.json").write_text(json.dumps(row))
