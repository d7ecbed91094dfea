# SPDX-License-Identifier: Apache-2.0
"""How fast the factory is here: every ratio against its plain twin of the same run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dataset_factory.make.generate import generate
from dataset_factory.plan.contents import make_plan
from dataset_factory.plan.job import Job
from dataset_factory.scene.blender import Blender
from dataset_factory.scene.catalogue import Scene
from rfgs_core.errors import RfgsError
from rfgs_core.frames import parse_frames

RADIO = "wifi"
MIN_FRAMES = 8


@dataclass(frozen=True)
class FactoryBench:
    """Size of the benchmark."""

    scene: Scene
    """Whose frames are made."""
    frames: str
    """Frames; at least `MIN_FRAMES`, so that starts do not count."""
    cameras: int = 2
    """Cameras of the pictures."""
    resolution: int = 256
    """Longer side of the pictures [px]."""
    repeats: int = 5
    """Times that a scene is loaded."""


def bench(config: FactoryBench, folder: Path, say: Callable[[str], None]) -> dict[str, float]:
    """Makes the frames with two workers and with one, and moves meshes beside loading them.

    Args:
        config: Size.
        folder: Where the data may lie meanwhile.
        say: Told what is under way.

    Returns:
        Ratios, seconds and gigabytes by name, for Wi-Fi at depth 2. `people_direct_s` and the
        stages are of one single-threaded process and frame; `people_bounces_s` and
        `trace_people_s` are per frame with two of them at work. Medians over frames.

    Raises:
        RfgsError: The scene cannot be used, or there are too few frames.
    """
    if len(parse_frames(config.frames)) < MIN_FRAMES:
        raise RfgsError(f"--frames {config.frames}: expected at least {MIN_FRAMES} frames")
    say("two workers, with pictures")
    two = _made(config, folder / "two", workers=2)
    say("one worker")
    one = _made(config, folder / "one", workers=1)
    say("moving meshes and loading scenes")
    load_s, move_s, frames = _update(config, folder / "update")
    speed_1, speed_2 = (job.speeds.get(f"trace {RADIO}") for job in (one, two))
    assert speed_1 is not None and speed_2 is not None
    stage = _stages(one)
    bounced = _stages(two)["people_bounces"] / 2.0
    return {
        "update_vs_reload_ratio": load_s / move_s,
        "reload_s": load_s,
        "update_s": move_s,
        "two_workers_ratio": speed_1.step_s / speed_2.step_s,
        "frame_one_worker_s": speed_1.step_s,
        "frame_two_workers_s": speed_2.step_s,
        "trace_people_s": bounced + _stages(two)["people_direct"] / 2.0,
        "people_direct_s": stage["people_direct"],
        "people_bounces_s": bounced,
        "worker_memory_gb": max(row[2]["memory_bytes"] for row in two.traced) / 1e9,
        "export_s": two.seconds["export"] / frames,
        "environment_s": two.traced[0][2]["seconds"]["environment"],
        "shadow_s": stage["shadow"],
        "people_s": stage["people_direct"] + stage["people_bounces"],
        "render_s": two.speeds["render"].step_s * config.cameras,
        "write_s": stage["write"],
        "frames": float(frames),
        "cores": float(os.cpu_count() or 1),
        "load_average": os.getloadavg()[0],
    }


def _made(config: FactoryBench, out: Path, workers: int) -> Job:
    """A finished job with the times of its frames."""
    plan = make_plan(
        config.scene,
        (RADIO,),
        config.frames,
        cameras=config.cameras,
        resolution=config.resolution,
        samples=16,
        depth=2,
        seed=0,
        shadow="kirchhoff",
        images=workers == 2,
    )
    job = Job(out, plan, Blender(config.scene.blend), workers)
    generate(job)
    return job


def _stages(job: Job) -> dict[str, float]:
    """Median seconds of each stage, without the first frames of each process."""
    rows = [reply["seconds"] for _, frame, reply in job.traced if frame is not None]
    rows = rows[job.workers :]
    return {name: float(np.median([row[name] for row in rows])) for name in rows[0]}


def _update(config: FactoryBench, folder: Path) -> tuple[float, float, int]:
    """Seconds per frame to export and load again, and to move what was exported at once."""
    from dataset_factory.scene.bundle import read_bundle
    from dataset_factory.trace.bench import load_and_move_s

    blender = Blender(config.scene.blend)
    start = time.perf_counter()
    blender.run("export", "--out", str(folder / "all"), "--frames", config.frames)
    all_s = time.perf_counter() - start
    frames = read_bundle(folder / "all").frames
    start = time.perf_counter()
    blender.run("export", "--out", str(folder / "single"), "--frames", f"{frames[0]}:{frames[0]}")
    single_s = time.perf_counter() - start
    load_s, move_s = load_and_move_s(folder / "all", RADIO, config.repeats)
    return single_s + load_s, all_s / len(frames) + move_s, len(frames)
