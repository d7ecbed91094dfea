# SPDX-License-Identifier: Apache-2.0
"""The channels of a sequence: what is missing is traced by workers and written here.

Only this process writes the dataset, so a worker that dies takes its frame with it and nothing
else.
"""

from __future__ import annotations

import hashlib
import time
from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING

from tqdm import tqdm

from dataset_factory.plan.contents import missing_channels, versions
from dataset_factory.plan.job import Job
from dataset_factory.scene.bundle import Bundle, frame_file
from dataset_factory.schedule.worker import Request, Task, Traced, close_place, trace_frame
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.schema import SequenceInfo, device_pose
from rfgs_core.files import write_bytes
from rfgs_core.past import Clock
from rfgs_core.schedule.archive import packed
from rfgs_core.schedule.spread import Spread
from rfgs_core.schedule.workers import Workers

if TYPE_CHECKING:
    from distributed import Future


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
    spread = Spread(job.workers, job.worker_memory_gb, job.scheduler)
    with spread.ready(
        len(tasks), job.work / "workers", job.out / "log", leave=close_place
    ) as workers:
        if job.scheduler:
            job.workers = workers.count
        _trace(job, bundle, sequence, tasks, workers)


def _trace(
    job: Job, bundle: Bundle, sequence: SequenceInfo, tasks: list[Task], workers: Workers
) -> None:
    request = _request(job, bundle, sequence, str((job.out / "log").absolute()))
    client = workers.client
    # A task of its own, so that Dask makes it again where the worker that held it died.
    scene = client.submit(bytes, packed(bundle.path, without="frames"), key=f"scene-{request.key}")

    def submit(task: Task) -> Future:
        moving = b"" if task.frame is None else frame_file(bundle.path, task.frame).read_bytes()
        return client.submit(trace_frame, request, scene, moving, task, pure=False)

    speed, spent = _Speeds(job), Counter()
    with speed, tqdm(total=len(tasks), desc="trace", unit="frame") as bar:
        for task, answer in workers.answers(tasks, submit, doing="tracing"):
            start = time.perf_counter()
            _write(job.files, sequence, task, answer.value)
            seconds = {**answer.seconds, "write": time.perf_counter() - start}
            spent.update({f"{task.radio}.{stage}": value for stage, value in seconds.items()})
            bar.set_postfix_str(str(task), refresh=False)
            bar.update()
            speed.step(task)
            told = {"seconds": seconds, "memory_bytes": answer.memory_bytes}
            job.traced.append((task.radio, task.frame, told))
    job.seconds.update({f"trace.{name}": value for name, value in sorted(spent.items())})


def _request(job: Job, bundle: Bundle, sequence: SequenceInfo, log: str) -> Request:
    """What every worker needs to know."""
    devices = {
        radio: [asdict(device_pose(row)) for row in rows]
        for radio, rows in sequence.devices.items()
    }
    plan = job.plan
    named = [(bundle.path / "bundle.json").read_bytes(), repr((plan, sequence.radios, devices))]
    text = b"".join(part if isinstance(part, bytes) else part.encode() for part in named)
    return Request(
        key=hashlib.sha256(text).hexdigest(),
        radios=sequence.radios,
        devices=devices,
        depth=plan.depth,
        shadow=plan.shadow,
        tracer=plan.tracer,
        device=job.device,
        seed=plan.seed,
        paths=plan.paths,
        versions=versions(),
        log="" if job.scheduler else log,
    )


def _write(files: SequenceFiles, sequence: SequenceInfo, task: Task, traced: Traced) -> None:
    """Writes the table of paths, if there is one, then a channel and its marker."""
    if traced.paths:
        write_bytes(files.paths(task.radio, task.frame), traced.paths)
    index = None if task.frame is None else sequence.frames.index(task.frame)
    marker = files.csi_done(task.radio, task.frame)
    write_csi(files.csi(task.radio), index, traced.channel, marker)


class _Speeds:
    """The speed of each radio's frames; radios follow one another."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._radio = ""
        # The static channel meets none of the kernels that a first frame compiles or loads.
        self._clock = Clock(job.workers, first=1)

    def step(self, task: Task) -> None:
        """A frame is done."""
        if self._radio not in ("", task.radio):
            self._note()
            self._clock = Clock(self._job.workers, first=1, began_s=self._clock.ends_s[-1])
        self._radio = task.radio
        self._clock.step()

    def __enter__(self) -> None:
        """Tracing begins."""

    def __exit__(self, *_error: object) -> None:
        """Tracing has ended, or was stopped."""
        self._note()

    def _note(self) -> None:
        """Keeps the speed of the last radio."""
        self._job.note_speed(f"trace {self._radio}", self._clock)
