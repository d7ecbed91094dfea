# SPDX-License-Identifier: Apache-2.0
"""How long a dataset takes here: from an earlier run like it, else from its first frames.

Every whole run of `generate` leaves the speed of its stages in the user's cache, by scene,
settings, versions and machine. Where there is none, a few frames, spread over the wanted ones,
are made for real in a temporary folder; that is the same measurement.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from dataset_factory.make.generate import generate
from dataset_factory.plan.job import Job
from dataset_factory.plan.speed_cache import Recalled, recalled
from rfgs_core.errors import RfgsError
from rfgs_core.frames import parse_frames


@dataclass(frozen=True)
class Estimate:
    """What a dataset will take."""

    frames: int
    """Frames."""
    cameras: int
    """Cameras."""
    seconds: dict[str, float]
    """Wall time by stage [s]."""
    disk_bytes: float
    """Disk [B]."""
    measured_now: bool
    """Whether frames were made for it, not remembered."""


def estimate(job: Job, known_frames: str) -> Estimate:
    """What a job will take, all of it.

    Args:
        job: The job; its folder is not touched.
        known_frames: All frames of the scene, where they are known without opening it.

    Raises:
        RfgsError: The scene cannot be used, or its frames are not known.
    """
    ranged = job.plan.overrides.get("frame_range", "")
    if isinstance(ranged, list):
        ranged = ":".join(map(str, ranged))
    text = job.plan.frames or str(ranged) or known_frames
    if not text:
        raise RfgsError(f"{job.blender.blend}: give the frames to plan for, as in --frames 1:60")
    frames = list(parse_frames(text))
    found = recalled(job)
    if found is None:
        _measure(job, frames)
        known = recalled(job)
        if known is None:
            raise RfgsError(
                f"--frames {text}: too few to tell a speed; give at least "
                f"{max(2 * job.workers - 1, 2)} frames, or fewer --workers"
            )
    else:
        known = found
    return _scaled(known, len(frames), found is None)


def _scaled(known: Recalled, frames: int, measured_now: bool) -> Estimate:
    seconds = {}
    for name, speed in known.speeds.items():
        if name == "render":
            # Blender starts once more for the empty room.
            pictures = known.cameras * (frames + 1)
            seconds[name] = speed.seconds(pictures) + speed.start_s
        else:
            seconds[name] = speed.seconds(frames + 1 if name.startswith("trace") else frames)
    seconds["write"] = known.rest_s * frames
    return Estimate(frames, known.cameras, seconds, known.space.bytes(frames), measured_now)


def _measure(job: Job, frames: list[int]) -> None:
    """Makes a few of the frames, which leaves their speed in the cache."""
    count = min(2 * job.workers + 1, len(frames))
    step = (len(frames) - 1) // max(count - 1, 1)
    chosen = frames[:: max(step, 1)][:count]
    gap = chosen[1] - chosen[0] if len(chosen) > 1 else 1
    text = f"{chosen[0]}:{chosen[-1]}:{gap}"
    with tempfile.TemporaryDirectory(prefix="rfgs-plan-") as folder:
        generate(replace(job, out=Path(folder) / "dataset", plan=replace(job.plan, frames=text)))
