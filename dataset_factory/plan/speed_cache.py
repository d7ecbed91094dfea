# SPDX-License-Identifier: Apache-2.0
"""Remembers how fast jobs went on this machine, in the user's cache."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from dataclasses import asdict, dataclass
from pathlib import Path

from dataset_factory.plan.contents import versions
from dataset_factory.plan.disk import Space
from dataset_factory.plan.job import Job
from dataset_factory.plan.speed import Speed
from rfgs_core.cache import cache_folder
from rfgs_core.files import write_json
from rfgs_core.records import read_record


def remember(job: Job, frames: int, cameras: int, space: Space) -> None:
    """Keeps the speed of a whole run for later estimates; anything less is left out."""
    stages = {"export", *(f"trace {radio}" for radio in job.plan.radios)}
    stages |= {"render"} if job.plan.images else set()
    if not stages <= set(job.speeds):
        return
    rest = sum(job.seconds.get(name, 0.0) for name in ("impair", "finish")) / frames
    write_json(_file(job), asdict(Recalled(job.speeds, rest, cameras, space)))


@dataclass(frozen=True)
class Recalled:
    """What is remembered of a job."""

    speeds: dict[str, Speed]
    """Speed of each stage."""
    rest_s: float
    """Time that everything else takes for a frame [s]."""
    cameras: int
    """Cameras that were rendered."""
    space: Space
    """Disk that it took."""


def recalled(job: Job) -> Recalled | None:
    """What is remembered of jobs like this one; None if nothing is."""
    file = _file(job)
    return read_record(file, Recalled, "delete it") if file.is_file() else None


def _file(job: Job) -> Path:
    """Where the speed of jobs like this one lies; frames, seed and folder do not count."""
    plan = {key: value for key, value in asdict(job.plan).items() if key not in ("frames", "seed")}
    machine = [platform.node(), platform.processor(), platform.machine(), os.cpu_count()]
    what = [plan, job.workers, job.scheduler, str(job.blender.program), versions(), machine]
    key = hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()
    return cache_folder("speeds") / f"{key[:32]}.json"
