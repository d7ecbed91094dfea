# SPDX-License-Identifier: Apache-2.0
"""Remembers how fast jobs went on this machine, in the user's cache."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dataset_factory.plan.contents import versions
from dataset_factory.plan.disk import Space
from dataset_factory.plan.job import Job
from rfgs_core.cache import cache_folder
from rfgs_core.files import read_json, write_json


def remember(job: Job, frames: int, cameras: int, space: Space) -> None:
    """Keeps the speed of a whole run for later estimates; anything less is left out."""
    stages = {"export", *(f"trace {radio}" for radio in job.plan.radios)}
    stages |= {"render"} if job.plan.images else set()
    if not stages <= set(job.speeds):
        return
    rest = sum(job.seconds.get(name, 0.0) for name in ("impair", "finish")) / frames
    value = {
        "speeds": {name: asdict(speed) for name, speed in job.speeds.items()},
        "rest_s": rest,
        "cameras": cameras,
        "space": asdict(space),
    }
    write_json(_file(job), value)


def recalled(job: Job) -> dict[str, Any] | None:
    """What is remembered of jobs like this one; None if nothing is."""
    file = _file(job)
    return read_json(file) if file.is_file() else None


def _file(job: Job) -> Path:
    """Where the speed of jobs like this one lies; frames, seed and folder do not count."""
    plan = {key: value for key, value in asdict(job.plan).items() if key not in ("frames", "seed")}
    machine = [platform.node(), platform.processor(), platform.machine(), os.cpu_count()]
    what = [plan, job.workers, job.scheduler, str(job.blender.program), versions(), machine]
    key = hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()
    return cache_folder("speeds") / f"{key[:32]}.json"
