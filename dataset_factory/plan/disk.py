# SPDX-License-Identifier: Apache-2.0
"""How much disk a dataset needs, before most of it is there."""

from __future__ import annotations

import shutil
from dataclasses import dataclass

import numpy as np

from dataset_factory.plan.job import Job
from dataset_factory.scene.bundle import Bundle, frame_file
from rfgs_core.dataset.csi_store import open_csi
from rfgs_core.dataset.schema import SequenceInfo, device_pose
from rfgs_core.errors import RfgsError
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
    tx, rx = np.nonzero(spread.measured)
    pairs = np.unique(np.stack([spread.tx_site[tx], spread.rx_site[rx]]), axis=1).shape[1]
    return PATH_BYTES_PER_PAIR * pairs


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
            f"{job.out}: the dataset needs about {gigabytes(needed_bytes - there)} more, "
            f"{gigabytes(free)} are free; take fewer --frames or --cameras, or another --out"
        )


def gigabytes(size: float) -> str:
    """A size in megabytes or gigabytes."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
