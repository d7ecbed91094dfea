# SPDX-License-Identifier: Apache-2.0
"""What a dataset takes, before it is made: frames, pictures, disk and time."""

from __future__ import annotations

from dataset_factory.plan.job import Job
from dataset_factory.plan.stages import Size, stages
from rfgs_core.past import count_in_words, forecast, in_words, size_in_words


def price_line(job: Job, size: Size, disk_bytes: float) -> str:
    """One line before a dataset is made: how much of what, and what would be less.

    Args:
        job: The job.
        size: How much it makes.
        disk_bytes: Disk that is needed, at most [B].
    """
    radios = len(job.plan.radios)
    what = f"{count_in_words(size.frames, 'frame')} of {count_in_words(radios, 'radio')}"
    what += f", {size.pictures} pictures" if size.cameras else ", no pictures"
    time = forecast(stages(job, size))
    less = "fewer --frames" + (", --cameras" * bool(size.cameras)) + " or --depth 1 make it less"
    return (
        f"{what}; at most {size_in_words(disk_bytes)}; about {in_words(time.total_s)} from the "
        f"start, {time.source}; {less}"
    )


def price_table(job: Job, size: Size, disk_bytes: float) -> str:
    """The lines that `plan` prints; arguments are those of `price_line`."""
    time = forecast(stages(job, size))
    each = ", ".join(f"{name} {in_words(value)}" for name, value in time.seconds.items())
    return (
        f"scene   {job.plan.scene}, radio {', '.join(job.plan.radios)}\n"
        f"frames  {size.frames}, {size.cameras} cameras, {size.pictures} pictures, "
        f"{job.workers} workers\n"
        f"disk    {size_in_words(disk_bytes)} at most\n"
        f"time    {in_words(time.total_s)}: {each}\n"
        f"        on {job.scheduler or 'this machine'}: {time.source}\n"
    )
