# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory plan`."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from dataset_factory.cli.generate import GenerateArgs, job_of


@dataclass(frozen=True)
class PlanArgs(GenerateArgs):
    """Prints the frames, disk and time that `generate` would take.

    Takes the arguments of `generate`. The time comes from an earlier run with these settings on
    this machine, or on this cluster with as many threads; where there is none, the first few
    frames are made in OUT, which takes half a minute for a room: `generate` goes on with them, and
    the next plan with other settings replaces them. Exit code 2 if the disk is too small.
    """


def run(args: PlanArgs) -> int:
    """Prints the estimate."""
    from dataset_factory.make.estimate import estimate
    from dataset_factory.plan.disk import gigabytes, refuse_small_disk
    from dataset_factory.plan.price import minutes
    from dataset_factory.schedule.workers import count_workers

    job, scene = job_of(args)
    if job.scheduler:
        job.workers = count_workers(job.scheduler)
    found = estimate(job, scene.frames)
    measured = "an earlier run"
    if found.measured_now:
        measured = f"the first frames, made just now and kept in {args.out}"
    stages = ", ".join(f"{name} {minutes(value)}" for name, value in found.seconds.items())
    total = sum(found.seconds.values())
    sys.stdout.write(
        f"scene   {scene.name}, radio {', '.join(job.plan.radios)}\n"
        f"frames  {found.frames}, {found.cameras} cameras, {job.workers} workers\n"
        f"disk    {gigabytes(found.disk_bytes)} at most\n"
        f"time    {minutes(total)}: {stages}\n"
        f"        measured on {job.scheduler or 'this machine'}: {measured}\n"
    )
    refuse_small_disk(job, found.disk_bytes)
    return 0
