# SPDX-License-Identifier: Apache-2.0
"""Whether a scene is small enough for the radios of a job."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dataset_factory.plan.job import Job
from dataset_factory.scene.report_rows import read_report
from rfgs_core.errors import RfgsError
from rfgs_core.radio.check import too_far

#: Radios that tell paths of this length apart need no look at the scene's size beforehand [m].
_ANY_SCENE_M = 100.0


def refuse_large_scene(job: Job) -> None:
    """Refuses a scene too large for a radio before all of its frames are exported.

    Raises:
        RfgsError: A radio's subcarriers are too far apart for the scene.
    """
    radios = [job.plan.radio(name) for name in job.plan.radios]
    if all(radio.unambiguous_path_m > _ANY_SCENE_M for radio in radios):
        return
    asked = ["--frames", job.plan.frames] if job.plan.frames else []
    with TemporaryDirectory(prefix="rfgs-") as name:
        file = Path(name) / "check.json"
        job.run_blender("check", "--out", str(file), *asked)
        bounds_m = read_report(file)["scene"]["bounds_m"]
    if bounds_m is None:
        # Nothing moves, or the like: the export says so.
        return
    problems = [text for radio in radios for text in too_far(radio, np.array(bounds_m))]
    if problems:
        raise RfgsError(f"{job.blender.blend.stem}: " + "; also: ".join(problems))
