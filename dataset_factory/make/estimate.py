# SPDX-License-Identifier: Apache-2.0
"""How long a dataset takes here: from an earlier run like it, else from its first frames.

Every whole run of `generate` leaves the speed of its stages in the user's cache, by scene,
settings, versions and machine. Where there is none, the first few frames are made for real in the
job's own folder, where `generate` finds them: that is the same measurement, and nothing is made
twice.
"""

from __future__ import annotations

from dataclasses import replace

from dataset_factory.make.generate import generate
from dataset_factory.plan.job import Job
from dataset_factory.plan.price import Estimate, scaled
from dataset_factory.plan.speed_cache import recalled
from rfgs_core.errors import RfgsError
from rfgs_core.frames import parse_frames


def estimate(job: Job, known_frames: str) -> Estimate:
    """What a job will take, all of it.

    Args:
        job: The job; its folder gets the first frames where no speed is known.
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
        generate(replace(job, taste=True))
        known = recalled(job)
        if known is None:
            raise RfgsError(
                f"--frames {text}: too few to tell a speed; give at least "
                f"{max(2 * job.workers - 1, 2)} frames, or fewer --workers"
            )
    else:
        known = found
    return scaled(known, len(frames), found is None)
