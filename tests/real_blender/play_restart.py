# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside the Blender that follows one which was killed: its job is found and resumed.

Arguments: Python program of the environment, Blender program.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Stops the job that is still running, then resumes it to its end."""
    jobs = stage.part("jobs.following").QUEUE
    assert [job.state for job in jobs.jobs] == ["Running"], "found before anything is pressed"
    yield from stage.open_tab("RFGS_PT_jobs")
    stored = stage.part("jobs.preferences").preferences()
    stored.python, stored.blender = stage.arguments
    yield from stage.wait(lambda: bool(jobs.jobs), "what was left", 20.0)
    assert [job.state for job in jobs.jobs] == ["Running"], [job.state for job in jobs.jobs]
    bpy.ops.rfgs.stop_job()  # at once: it would be done before its button is found
    yield from stage.wait(lambda: jobs.jobs[0].state not in ("Running", "Stopping"), "stopped", 60)
    assert jobs.jobs[0].state == "Stopped", jobs.jobs[0].message
    yield from stage.shoot("stopped", "SIDEBAR")
    yield from stage.click("rfgs.resume_job")
    yield from stage.wait(lambda: jobs.jobs[0].state not in ("Waiting", "Running"), "resumed")
    assert jobs.jobs[0].state == "Done", jobs.jobs[0].message
    yield from stage.shoot("resumed", "SIDEBAR")
