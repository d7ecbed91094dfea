# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory plan`."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from dataset_factory.cli.generate import GenerateArgs, job_of


@dataclass(frozen=True)
class PlanArgs(GenerateArgs):
    """Prints the frames, disk and time that `generate` would take.

    Takes the arguments of `generate`, looks into the scene, and makes nothing; a folder or a scene
    that `generate` would refuse is refused. The time comes from earlier runs like this on this
    machine, or on this cluster with as many threads; stages that never ran here are estimated from
    usual speeds of two cores, and the output says which. Exit code 2 if the disk is too small.
    """


def run(args: PlanArgs) -> int:
    """Prints the estimate."""
    from dataset_factory.plan.disk import expected_space, refuse_small_disk
    from dataset_factory.plan.folder import open_folder
    from dataset_factory.plan.price import price_table
    from dataset_factory.plan.scene_size import refuse_large_scene
    from dataset_factory.plan.stages import size_of_outline
    from rfgs_core.interrupts import nothing_is_made
    from rfgs_core.schedule.workers import count_workers

    nothing_is_made()
    job, outline = job_of(args)
    if open_folder(job):
        refuse_large_scene(job)
    if job.scheduler:
        job.workers = count_workers(job.scheduler)
    size = size_of_outline(job.plan, outline)
    disk_bytes = expected_space(job, size).bytes(size.frames)
    sys.stdout.write(price_table(job, size, disk_bytes))
    refuse_small_disk(job, disk_bytes)
    return 0
