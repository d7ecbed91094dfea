# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory plan`."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from dataset_factory.cli.generate import GenerateArgs, job_of


@dataclass(frozen=True)
class PlanArgs(GenerateArgs):
    """Prints the frames, disk and time that `generate` would take; nothing is kept.

    Takes the arguments of `generate`. The time comes from an earlier run with these settings on
    this machine, or on this cluster with as many threads; where there is none, a few frames are
    made in a temporary folder, which takes a minute or two. Exit code 2 if the disk is too small.
    """


def run(args: PlanArgs) -> int:
    """Prints the estimate."""
    from dataset_factory.make.estimate import estimate
    from dataset_factory.plan.disk import gigabytes, refuse_small_disk
    from dataset_factory.schedule.workers import count_workers

    job, scene = job_of(args)
    if job.scheduler:
        job.workers = count_workers(job.scheduler)
    found = estimate(job, scene.frames)
    measured = "a few frames made just now" if found.measured_now else "an earlier run"
    stages = ", ".join(f"{name} {_minutes(value)}" for name, value in found.seconds.items())
    total = sum(found.seconds.values())
    sys.stdout.write(
        f"scene   {scene.name}, radio {', '.join(job.plan.radios)}\n"
        f"frames  {found.frames}, {found.cameras} cameras, {job.workers} workers\n"
        f"disk    {gigabytes(found.disk_bytes)} at most\n"
        f"time    {_minutes(total)}: {stages}\n"
        f"        measured on {job.scheduler or 'this machine'}: {measured}\n"
    )
    refuse_small_disk(job, found.disk_bytes)
    return 0


def _minutes(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
