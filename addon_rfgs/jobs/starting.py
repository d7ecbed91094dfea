# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs out of the settings of a scene, begun in the background or carried out at once."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..devices.empties import devices
from ..errors import AddonError
from ..reporting import Progress, chosen_path
from ..scene.taking_part import left_out, radio_of, wanted_radios
from . import following
from .plans import EvaluatePlan, GeneratePlan, Plan, TrainPlan
from .preferences import blender_program
from .queue import ACTIVE, DONE, RUNNING, STOPPING, Job
from .record import log_file

_EVERY_S = 0.2
#: Settings that a dataset's plan takes as they are.
_SAID = (
    *("frames", "cameras", "resolution", "samples", "images", "depth", "workers", "paths"),
    "seed",
)


def generate_plan(scene: bpy.types.Scene) -> GeneratePlan:
    """A dataset of the open file, as the panel describes it.

    Raises:
        AddonError: The file was never saved.
    """
    if not bpy.data.filepath:
        raise AddonError("the scene was never saved; save it first")
    said = scene.rfgs.jobs
    return GeneratePlan(
        out=_absolute(said.dataset_folder),
        blend=bpy.data.filepath,
        blender=blender_program(),
        radios=",".join(wanted_radios(scene)),
        **{name: getattr(said, name) for name in _SAID},
    )


def doing_without(scene: bpy.types.Scene) -> str:
    """Which devices of the scene a dataset does without, in words; empty if it has them all."""
    found = left_out([(item.name, radio_of(item)) for item in devices(scene)], wanted_radios(scene))
    groups = [f"{', '.join(names)} (radio {radio!r})" for radio, names in found.items()]
    return f"left out: {', '.join(groups)}" if groups else ""


def dataset_to_come(scene: bpy.types.Scene) -> bool:
    """Whether the panel's dataset is there, or on its way."""
    folder = scene.rfgs.jobs.dataset_folder
    if folder.startswith("//") and not bpy.data.filepath:
        return False
    path = Path(bpy.path.abspath(folder))
    jobs = following.QUEUE.jobs
    return (path / "dataset.json").is_file() or any(Path(job.plan.out) == path for job in jobs)


def train_plan(scene: bpy.types.Scene) -> TrainPlan:
    """A training on the panel's dataset."""
    said = scene.rfgs.jobs
    return TrainPlan(
        out=_absolute(said.run_folder),
        dataset=_absolute(said.dataset_folder),
        radio=said.train_radio or wanted_radios(scene)[0],
        frames=said.train_frames,
        iterations=said.iterations,
        gaussians=said.gaussians,
        seed=said.seed,
    )


def evaluate_plan(scene: bpy.types.Scene) -> EvaluatePlan:
    """The evaluation of the panel's run."""
    return EvaluatePlan(out=_absolute(scene.rfgs.jobs.run_folder))


def start(plan: Plan, python: Path, progress: Progress) -> str:
    """Begins a job, or puts it behind those that run; without a window it is carried out at once.

    Args:
        plan: What it does.
        python: The environment's Python.
        progress: Called with done and total of the present stage while it is carried out.

    Returns:
        What happened, in one line.

    Raises:
        AddonError: The folder is taken, or the job fails at once.
    """
    job = following.QUEUE.add(plan, python)
    if bpy.app.background:
        return _carry_out(job, progress)
    following.follow()
    return f"{job.title} is in the list of jobs"


def stop_and_wait(job: Job) -> None:
    """Asks a job to stop and waits until it has."""
    following.QUEUE.stop(job)
    while job.state in (RUNNING, STOPPING):
        following.QUEUE.step()
        time.sleep(_EVERY_S)


def _carry_out(job: Job, progress: Progress) -> str:
    """Runs a job of the queue to its end.

    Raises:
        AddonError: The job failed; the message is the program's own.
    """
    seen = None
    try:
        with _ctrl_c():
            while job.state in ACTIVE:
                following.QUEUE.step()
                if job.progress and job.progress != seen:
                    seen = job.progress
                    progress(int(seen.done), int(seen.total))
                time.sleep(_EVERY_S)
    except KeyboardInterrupt:
        stop_and_wait(job)
    except BaseException:
        stop_and_wait(job)
        raise
    if job.state != DONE:
        raise AddonError(f"{job.state.lower()}: {job.message} (log: {log_file(job.plan)})")
    return f"{job.title} is done: {job.plan.out}"


def _absolute(folder: str) -> str:
    return str(Path(chosen_path(folder)).absolute())


@contextmanager
def _ctrl_c() -> Iterator[None]:
    """Lets Ctrl-C raise `KeyboardInterrupt`: without a window Blender takes it and does nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        # Blender's own handler, set in C, is None here and cannot be put back from Python.
        signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)
