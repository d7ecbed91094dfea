# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs one after the other; knows nothing of Blender, so that it runs under tests as it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from ..errors import AddonError
from .plans import Plan
from .process import Process, need_support
from .progress import Progress, read_log, reason
from .record import (
    Record,
    log_file,
    read_record,
    record_file,
    remember,
    remembered,
    write_record,
)

WAITING, RUNNING, STOPPING = "Waiting", "Running", "Stopping"
DONE, FAILED, STOPPED = "Done", "Failed", "Stopped"
ACTIVE = (WAITING, RUNNING, STOPPING)

#: How long a job may take to stop by itself before it is killed [s].
GRACE_S = 15.0


class Job:
    """One job: waiting, at work or ended."""

    def __init__(self, plan: Plan, python: Path | None) -> None:
        self.plan, self.python = plan, python
        self.state = WAITING
        self.process: Process | None = None
        self.progress: Progress | None = None
        self.tail: list[str] = []
        self.asked_s: float | None = None
        """When it was asked to stop [s, monotonic]."""

    @property
    def title(self) -> str:
        """What it does, and where."""
        return f"{self.plan.label}: {Path(self.plan.out).name}"

    @property
    def message(self) -> str:
        """How it stands, in one line."""
        if self.state == RUNNING:
            return str(self.progress) if self.progress else "starting"
        if self.state == FAILED:
            return reason(self.tail) or "it said nothing; see the log"
        if self.state == STOPPED:
            return "finished work is kept; Resume continues"
        return self.state.lower()

    def same(self, plan: Plan) -> bool:
        """Whether a plan is of the same kind and for the same folder."""
        return (self.plan.out, self.plan.kind) == (plan.out, plan.kind)

    def refresh(self) -> None:
        """Reads the log."""
        self.progress, self.tail = read_log(log_file(self.plan))


class Queue:
    """Runs jobs one after the other."""

    def __init__(self, listed: Callable[[], Path | None]) -> None:
        """Begins empty.

        Args:
            listed: Where unfinished jobs are listed for the next Blender; None for nowhere.
        """
        self.jobs: list[Job] = []
        self._listed = listed
        self._known: set[Path] = set()

    def add(self, plan: Plan, python: Path) -> Job:
        """Puts a job at the end.

        Raises:
            AddonError: Another one works on that folder, nothing can be written there, or this
                system runs no jobs.
        """
        need_support()
        plan.arguments()
        if any(job.same(plan) and job.state in ACTIVE for job in self.jobs):
            raise AddonError(f"{plan.out}: such a job is in the list already")
        _refuse_running(plan)
        write_record(Record(plan, 0, ""))
        self.jobs = [job for job in self.jobs if not job.same(plan)]
        self.jobs.append(Job(plan, python))
        self._remember()
        return self.jobs[-1]

    def restore(self, record: Record) -> Job:
        """Takes over a job that an earlier Blender left: running still, done or to be resumed."""
        for known in self.jobs:
            if known.same(record.plan):
                return known
        job = Job(record.plan, None)
        job.process = Process(record.pid, record.born)
        job.state = RUNNING
        self.jobs.append(job)
        self._follow(job)
        self._remember()
        return job

    def stop(self, job: Job) -> None:
        """Asks a job to stop; a waiting one has not begun."""
        if job.state == WAITING:
            job.state = STOPPED
        elif job.state == RUNNING and job.process:
            job.process.interrupt()
            job.state, job.asked_s = STOPPING, time.monotonic()

    def forget(self, job: Job) -> None:
        """Takes an ended job off the list; its files stay."""
        if job.state in ACTIVE:
            raise AddonError("this job is not over; stop it first")
        self.jobs.remove(job)
        self._remember()

    def step(self) -> bool:
        """Looks after everything once; whether something is left to look after."""
        for job in self.jobs:
            if job.state in (RUNNING, STOPPING):
                self._follow(job)
        if not any(job.state in (RUNNING, STOPPING) for job in self.jobs):
            waiting = next((job for job in self.jobs if job.state == WAITING), None)
            if waiting:
                self._begin(waiting)
        return any(job.state in ACTIVE for job in self.jobs)

    def _begin(self, job: Job) -> None:
        try:
            _refuse_running(job.plan)
            command = [str(job.python), *job.plan.arguments()]
            job.process = Process.start(command, log_file(job.plan))
            write_record(Record(job.plan, job.process.pid, job.process.born))
            job.state = RUNNING
        except AddonError as error:
            if job.process:
                job.process.interrupt()
            job.state, job.tail = FAILED, [f"error: {error}"]
        self._remember()

    def _follow(self, job: Job) -> None:
        process = job.process
        assert process is not None
        if process.running():
            job.refresh()
            if job.asked_s is not None and time.monotonic() - job.asked_s > GRACE_S:
                process.kill()
            return
        job.refresh()
        code = process.code
        if code == 0 or (code is None and job.plan.complete()):
            job.state = DONE
        elif code is None or code == 130 or job.state == STOPPING:
            job.state = STOPPED
        else:
            job.state = FAILED
        self._remember()

    def _remember(self) -> None:
        listed = self._listed()
        self._known.update(record_file(job.plan) for job in self.jobs)
        if listed is not None:
            unfinished = [record_file(job.plan) for job in self.jobs if job.state != DONE]
            # What another Blender has put there stays.
            others = [file for file in remembered(listed) if file not in self._known]
            remember([*others, *unfinished], listed)


def _refuse_running(plan: Plan) -> None:
    """Refuses a job whose process, started by another Blender, is still at work.

    Raises:
        AddonError: It is.
    """
    try:
        record = read_record(record_file(plan))
    except AddonError:
        return
    if Process(record.pid, record.born).running():
        raise AddonError(f"{plan.out}: another Blender's job is running there; stop it first")
