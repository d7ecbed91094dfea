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
    # At once: the job goes on, and must not be over before it is stopped.
    bpy.ops.rfgs.stop_job()
    yield from stage.wait(lambda: jobs.jobs[0].state not in ("Running", "Stopping"), "stopped", 60)
    yield from stage.open_tab("RFGS_PT_jobs")
    stored = stage.part("jobs.preferences").preferences()
    stored.python, stored.blender = stage.arguments
    assert jobs.jobs[0].state == "Stopped", jobs.jobs[0].message
    yield from stage.shoot("stopped", "SIDEBAR")
    yield from stage.click("rfgs.resume_job")
    yield from stage.wait(lambda: jobs.jobs[0].state not in ("Waiting", "Running"), "resumed")
    assert jobs.jobs[0].state == "Done", jobs.jobs[0].message
    yield from stage.shoot("resumed", "SIDEBAR")
