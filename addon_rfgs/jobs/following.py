# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps an eye on jobs from Blender's main loop, only while there are some."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..errors import AddonError
from .checking import CHECK
from .preferences import ADDON, preferences
from .queue import Job, Queue
from .record import read_record, remembered

_EVERY_S = 0.5


def _listed() -> Path | None:
    """List of unfinished jobs in the extension's user folder; None without such a folder."""
    try:
        return Path(bpy.utils.extension_path_user(ADDON, create=True)) / "jobs.json"
    except ValueError:
        # Registered as a plain package: extensions alone have a folder.
        return None


QUEUE = Queue(_listed)


def follow() -> None:
    """Begins to look after jobs, unless that is under way."""
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


def chosen_job() -> Job | None:
    """The job of the list's active row."""
    stored = preferences()
    if stored is None or not 0 <= stored.active_job < len(QUEUE.jobs):
        return None
    return QUEUE.jobs[stored.active_job]


def show() -> None:
    """Copies the jobs into the rows of the list, and draws the tab again."""
    stored = preferences()
    if stored is not None:
        while len(stored.jobs) > len(QUEUE.jobs):
            stored.jobs.remove(len(stored.jobs) - 1)
        while len(stored.jobs) < len(QUEUE.jobs):
            stored.jobs.add()
            # Whoever begins a job looks at that one next.
            stored.active_job = len(stored.jobs) - 1
        for row, job in zip(stored.jobs, QUEUE.jobs, strict=True):
            row.name = row.title = job.title
            row.state, row.message = job.state, job.message
            row.share = job.progress.share if job.progress else 0.0
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            # The sidebar alone: drawing a heavy scene twice a second would make Blender slow.
            part = {"VIEW_3D": "UI", "PREFERENCES": "WINDOW"}.get(area.type)
            for region in area.regions:
                if region.type == part:
                    region.tag_redraw()


def _tick() -> float | None:
    jobs, check = QUEUE.step(), CHECK.step()
    show()
    return _EVERY_S if jobs or check else None


def _restore() -> None:
    """Finds what an earlier Blender left unfinished."""
    listed = _listed()
    for file in remembered(listed) if listed else []:
        try:
            QUEUE.restore(read_record(file))
        except AddonError as error:
            print(f"RF-GS: {error}")  # noqa: T201
    follow()


def register() -> None:
    """Looks for unfinished jobs as soon as Blender is up."""
    if preferences() is not None:
        preferences().jobs.clear()
    listed = _listed()
    if not bpy.app.background and listed and remembered(listed):
        # Persistent, as Blender opens the file of its command line only after this.
        bpy.app.timers.register(_restore, first_interval=0.0, persistent=True)


def unregister() -> None:
    """Looks away; jobs that run go on, and the next Blender finds them."""
    for timer in (_tick, _restore):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    CHECK.cancel()
    QUEUE.jobs.clear()
