# SPDX-License-Identifier: Apache-2.0
"""The stages of a job as past times know them: how many steps, and what a step usually takes."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dataset_factory.plan.contents import Plan, versions
from dataset_factory.plan.job import Job
from dataset_factory.plan.usual import EXPORT, PACKET, PATHS, RENDER_START_S, TRACE, render_step_s
from dataset_factory.scene.outline import Outline, device_radios
from rfgs_core.dataset.schema import SequenceInfo, device_pose
from rfgs_core.past import Speed, Stage, note_speed
from rfgs_core.radio import PRESETS, DevicePose, Layout, Radio, frame_samples, layout
from rfgs_core.simulate.packets import TRACE_STEP_S


@dataclass(frozen=True)
class Size:
    """How much there is to make."""

    frames: int
    """Frames."""
    cameras: int
    """Cameras whose pictures are rendered; 0 without pictures."""
    pixels: int
    """Pixels of a frame, all cameras together."""
    people: int
    """People, or other things that move where nobody does."""
    fps: float
    """Frames per second."""
    layouts: dict[str, Layout]
    """Antenna elements of each radio; where they stand may not be known yet."""

    @property
    def pictures(self) -> int:
        """Pictures, the empty room's included."""
        return self.cameras * (self.frames + 1)


def size_of(plan: Plan, sequence: SequenceInfo) -> Size:
    """The size of a sequence that is described."""
    cameras = sequence.cameras if plan.images else []
    return Size(
        len(sequence.frames),
        len(cameras),
        sum(row["width"] * row["height"] for row in cameras),
        max(sum(bool(row["person"]) for row in sequence.instances), 1),
        sequence.fps,
        {
            name: layout(plan.radio(name), [device_pose(row) for row in rows])
            for name, rows in sequence.devices.items()
        },
    )


def size_of_outline(plan: Plan, outline: Outline) -> Size:
    """The size of a scene of which only the outline is known."""
    cameras = (plan.cameras or outline.cameras) if plan.images else 0
    pixels = plan.resolution * round(plan.resolution * outline.aspect)
    spreads = {name: _spread(plan.radio(name), outline.devices) for name in plan.radios}
    people = max(outline.people, 1)
    return Size(len(outline.frames), cameras, cameras * pixels, people, outline.fps, spreads)


def _spread(radio: Radio, rows: Sequence[dict[str, Any]]) -> Layout:
    """Antenna elements of a radio whose devices all stand at the origin."""
    names = device_radios(radio)
    roles = [row["role"] for row in rows if row["role"] != "NONE" and row["radio"] in names]
    roles = roles or ["ACCESS_POINT"] * radio.num_places
    stand, level = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    return layout(radio, [DevicePose(f"{n}", stand, level, role) for n, role in enumerate(roles)])


def heard_pairs(spread: Layout) -> int:
    """Pairs of a transmitting and a receiving site with a link between them."""
    tx, rx = np.nonzero(spread.measured)
    return np.unique(np.stack([spread.tx_site[tx], spread.rx_site[rx]]), axis=1).shape[1]


def stages(job: Job, size: Size) -> list[Stage]:
    """Every stage of a job, whether or not some of it is there already."""
    plan, frames = job.plan, size.frames
    scene = [plan.blend_sha256, plan.overrides, str(job.blender.program), versions()]
    spans = sorted({plan.radio(name).samples_per_frame > 1 for name in plan.radios})
    found = [Stage("export", "export", [scene, plan.paths, spans], frames, EXPORT)]
    found += [_trace(job, size, name, scene) for name in plan.radios]
    if size.cameras:
        each = Speed(RENDER_START_S, render_step_s(size.pixels / size.cameras, plan.samples))
        what = [scene, plan.cameras, plan.resolution, plan.samples]
        # Blender starts once more for the empty room.
        found.append(Stage("render", "render", what, size.pictures, each, starts=2))
    return found


def _trace(job: Job, size: Size, name: str, scene: Any) -> Stage:
    plan, radio = job.plan, job.plan.radio(name)
    depth = min(plan.depth, radio.deepest)
    like = _preset_like(radio, plan.tracer, depth)
    known = TRACE[plan.tracer, like.name, depth]
    pairs = heard_pairs(size.layouts[name]) / heard_pairs(_spread(like, []))
    step_s = known.step_s * size.people * pairs * (PATHS if plan.paths else 1.0)
    if radio.antennas_move:
        step_s *= radio.samples_per_frame / like.samples_per_frame
    elif radio.samples_per_frame > 1:
        # Traced anew every so often, and summed for every packet.
        span_s = frame_samples(radio, size.fps).offset_s[-1]
        traces = 1 + math.ceil(span_s / TRACE_STEP_S)
        step_s *= traces + PACKET[plan.tracer] * (radio.samples_per_frame - 1)
    # Speeds are of two workers, each on a core of its own.
    cores = job.workers if job.scheduler else min(job.workers, os.cpu_count() or 1)
    usual = Speed(known.start_s, step_s * 2.0 / cores)
    decides = [scene, asdict(radio), depth, plan.shadow, plan.paths, job.workers, job.scheduler]
    kind = f"trace-{plan.tracer}-{like.name}-{depth}"
    return Stage(f"trace {name}", kind, decides, size.frames + 1, usual)


def _preset_like(radio: Radio, tracer: str, depth: int) -> Radio:
    """The preset whose tracing is most like a radio's: by how it moves, then by its frequency."""
    there = [PRESETS[name] for kind, name, deep in TRACE if (kind, deep) == (tracer, depth)]
    return min(
        there,
        key=lambda other: (
            other.name != radio.name,
            other.antennas_move != radio.antennas_move,
            other.ultra_wide != radio.ultra_wide,
            abs(np.log(other.centre_hz / radio.centre_hz)),
        ),
    )


@contextmanager
def speeds_noted(job: Job, size: Size) -> Iterator[None]:
    """Keeps how fast stages went that had steps enough to tell, also where the block is stopped.

    Args:
        job: The job, as it was asked for.
        size: How much it makes.
    """
    try:
        yield
    finally:
        for stage in stages(job, size):
            if stage.name in job.speeds:
                note_speed(stage, job.speeds[stage.name])
