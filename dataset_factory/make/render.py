# SPDX-License-Identifier: Apache-2.0
"""The pictures of a sequence: rendered by Blender, encoded as soon as a frame is whole."""

from __future__ import annotations

import shutil
from pathlib import Path

from dataset_factory.make.encode import encode_empty, encode_frame, rendered_whole
from dataset_factory.plan.contents import frame_runs, missing_pictures
from dataset_factory.plan.job import Job
from dataset_factory.plan.progress import progress_bar
from rfgs_core.dataset.schema import SequenceInfo
from rfgs_core.frames import parse_frames
from rfgs_core.past import Clock


def render(job: Job, sequence: SequenceInfo) -> None:
    """Renders and encodes every picture that is missing.

    Raises:
        RfgsError: Blender failed, or a picture lacks a pass.
    """
    cameras = [row["name"] for row in sequence.cameras]
    rendered = job.work / "rendered"
    missing = missing_pictures(job.files, sequence.frames)
    size = ["--out", str(rendered), *job.picture_size, "--samples", str(job.plan.samples)]
    for run in frame_runs(missing):
        shutil.rmtree(rendered, ignore_errors=True)
        frames = list(parse_frames(run))
        with progress_bar("render") as progress, job.clock("render") as clock:

            def encode(
                done: int, total: int, frames: list[int] = frames, clock: Clock = clock
            ) -> None:
                progress(done, total)
                clock.step()
                # Frames are rendered one after the other with all cameras, so these are whole.
                _encode(job, rendered, cameras, frames[: done // len(cameras)])

            arguments = [*size, "--frames", run, "--passes"]
            job.run_blender("groundtruth", *arguments, progress=encode)
        _encode(job, rendered, cameras, frames)
    if any(not job.files.image_empty(camera).is_file() for camera in cameras):
        with progress_bar("empty room") as progress:
            frame = str(sequence.frames[0])
            arguments = [*size, "--frames", f"{frame}:{frame}", "--empty"]
            job.run_blender("groundtruth", *arguments, progress=progress)
        encode_empty(rendered, job.files, cameras)


def _encode(job: Job, rendered: Path, cameras: list[str], frames: list[int]) -> None:
    for frame in missing_pictures(job.files, frames):
        if rendered_whole(rendered, cameras, frame):
            encode_frame(rendered, job.files, cameras, frame)
            # What Blender wrote is larger than what is kept of it.
            for camera in cameras:
                for file in (rendered / camera).glob(f"{frame:06d}.*"):
                    file.unlink()
