# SPDX-License-Identifier: Apache-2.0
"""How much disk a dataset needs, before most of it is there."""

from __future__ import annotations

import shutil
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dataset_factory.plan.job import Job
from dataset_factory.plan.stages import Size, heard_pairs
from dataset_factory.plan.usual import GEOMETRY_BYTES, PERSON_BYTES
from dataset_factory.scene.bundle import Bundle, frame_file
from rfgs_core.dataset.csi_store import open_csi
from rfgs_core.dataset.schema import SequenceInfo, device_pose
from rfgs_core.errors import RfgsError
from rfgs_core.past import keep, recalled, size_in_words
from rfgs_core.radio import layout

#: Picture, depth, normals and mask of one pixel as they are stored [B]; 5.5 in a furnished room.
BYTES_PER_PIXEL = 6.0
#: Paths of one pair of sites as they are stored [B]; 45,000 in a furnished room at depth 2.
PATH_BYTES_PER_PAIR = 60_000.0


@dataclass(frozen=True)
class Space:
    """Disk that a dataset takes, from above: what compresses well is smaller."""

    once_bytes: float
    """Whatever the number of frames."""
    frame_bytes: float
    """For each frame."""

    def bytes(self, frames: int) -> float:
        """For so many frames."""
        return self.once_bytes + frames * self.frame_bytes


def space(job: Job, bundle: Bundle, sequence: SequenceInfo) -> Space:
    """What a sequence needs, from its empty stores and the files of its scene.

    Geometry counts twice, as the exported scene stays until the end. Tables of paths count as
    the largest of those that are there, or else as in a furnished room.
    """
    frames = len(sequence.frames)
    frame_bytes = 2.0 * frame_file(bundle.path, sequence.frames[0]).stat().st_size
    once = 2.0 * sum(
        file.stat().st_size
        for file in bundle.path.rglob("*")
        if file.is_file() and file.parent.name != "frames"
    )
    for radio in job.plan.radios:
        store = open_csi(job.files.csi(radio))
        # Links that do not exist are stored as zeros, which take no room.
        share = float(store["measured"].values.mean())
        copies = 2.0 if job.plan.impairments else 1.0
        frame_bytes += copies * share * store["csi"].nbytes / frames
        once += share * store["csi_static"].nbytes
        if job.plan.paths:
            table = _path_bytes(job, radio, sequence)
            frame_bytes += table
            once += table
    if job.plan.images:
        pixels = sum(row["width"] * row["height"] for row in sequence.cameras)
        frame_bytes += BYTES_PER_PIXEL * pixels
        once += BYTES_PER_PIXEL * pixels
    return Space(once, frame_bytes)


def _path_bytes(job: Job, radio: str, sequence: SequenceInfo) -> float:
    """Size of one table of paths [B]."""
    there = [job.files.paths(radio, frame) for frame in sequence.frames]
    sizes = [float(file.stat().st_size) for file in there if file.is_file()]
    if sizes:
        return max(sizes)
    spread = layout(job.plan.radio(radio), [device_pose(row) for row in sequence.devices[radio]])
    return PATH_BYTES_PER_PAIR * heard_pairs(spread)


def expected_space(job: Job, size: Size) -> Space:
    """What a scene needs of which only the outline is known: as it did before, else from above."""
    if known := recalled("space", _what(job), Space):
        return known
    plan, copies = job.plan, 2.0 if job.plan.impairments else 1.0
    once = GEOMETRY_BYTES + BYTES_PER_PIXEL * size.pixels
    frame_bytes = 2.0 * PERSON_BYTES * size.people + BYTES_PER_PIXEL * size.pixels
    for name, spread in size.layouts.items():
        radio = plan.radio(name)
        one = float(spread.measured.sum()) * radio.num_subcarriers * np.complex64().nbytes
        frame_bytes += copies * one * radio.samples_per_frame
        once += one * (radio.samples_per_frame if radio.antennas_move else 1)
        if plan.paths:
            once += PATH_BYTES_PER_PAIR * heard_pairs(spread)
            frame_bytes += PATH_BYTES_PER_PAIR * heard_pairs(spread)
    return Space(once, frame_bytes)


def keep_space(job: Job, needed: Space) -> None:
    """Keeps what a job needed for `expected_space`."""
    keep("space", _what(job), needed)


def _what(job: Job) -> dict[str, Any]:
    """What decides how much disk a frame takes."""
    return {
        name: value for name, value in asdict(job.plan).items() if name not in ("frames", "seed")
    }


def refuse_small_disk(job: Job, needed_bytes: float) -> None:
    """Refuses to begin what cannot end.

    Raises:
        RfgsError: There is less room than needed, after what is there already.
    """
    folder = next(path for path in (job.out, *job.out.resolve().parents) if path.exists())
    there = sum(file.stat().st_size for file in job.out.rglob("*") if file.is_file())
    free = shutil.disk_usage(folder).free
    if needed_bytes - there > free:
        raise RfgsError(
            f"{job.out}: the dataset needs about {size_in_words(needed_bytes - there)} more, "
            f"{size_in_words(free)} are free; take fewer --frames or --cameras, or another --out"
        )
