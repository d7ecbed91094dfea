# SPDX-License-Identifier: Apache-2.0
"""The channels of a sequence: what is missing is traced here or on a cluster."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tqdm import tqdm

from dataset_factory.bundle import Bundle
from dataset_factory.cluster import run_on_cluster, threads
from dataset_factory.job import Job
from dataset_factory.pace import Clock
from dataset_factory.plan import missing_channels
from dataset_factory.workers import Task, limits, run_tasks
from rfgs_core.dataset.schema import SequenceInfo, device_pose


def trace(job: Job, bundle: Bundle, sequence: SequenceInfo) -> None:
    """Traces every channel that is missing.

    Raises:
        RfgsError: A frame cannot be traced, or the cluster is not there.
        OSError: A disk was full.
    """
    tasks = [
        Task(radio, frame)
        for radio in job.plan.radios
        for frame in missing_channels(job.files, radio, sequence.frames, job.plan.paths)
    ]
    if not tasks:
        return
    request = _request(job, bundle, sequence)
    if job.scheduler:
        job.workers = threads(job.scheduler)
    pace = _Paces(job)
    with tqdm(total=len(tasks), desc="trace", unit="frame") as bar:

        def done(task: Task, reply: dict[str, Any]) -> None:
            bar.set_postfix_str(str(task), refresh=False)
            bar.update()
            pace.step(task)
            job.traced.append((task.radio, task.frame, reply))

        if job.scheduler:
            allowed = limits(1, job.worker_memory_gb)
            seconds = run_on_cluster(job.scheduler, request, tasks, allowed, done)
        else:
            allowed = limits(job.workers, job.worker_memory_gb)
            log = job.out / "log"
            seconds = run_tasks(request, tasks, job.workers, allowed, log, done)
    pace.note()
    job.seconds.update({f"trace.{name}": value for name, value in seconds.items()})


def _request(job: Job, bundle: Bundle, sequence: SequenceInfo) -> dict[str, Any]:
    """What every tracing process needs to know."""
    return {
        "bundle": str(bundle.path),
        "sequence": str(job.files.root),
        "radios": sequence.radios,
        "devices": {
            radio: [asdict(device_pose(row)) for row in rows]
            for radio, rows in sequence.devices.items()
        },
        "depth": job.plan.depth,
        "shadow": job.plan.shadow,
        "seed": job.plan.seed,
        "paths": job.plan.paths,
    }


class _Paces:
    """The pace of each radio's frames; radios follow one another."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._radio = ""
        self._clock = Clock(job.workers)

    def step(self, task: Task) -> None:
        """A frame is done."""
        if self._radio not in ("", task.radio):
            self.note()
            self._clock = Clock(self._job.workers, began_s=self._clock.ends_s[-1])
        self._radio = task.radio
        self._clock.step()

    def note(self) -> None:
        """Keeps the pace of the last radio."""
        self._job.note_pace(f"trace {self._radio}", self._clock)
