# SPDX-License-Identifier: Apache-2.0
"""A worker holds no more after 300 frames than after 50."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from dataset_factory.plan.contents import versions
from dataset_factory.plan.job import Job
from dataset_factory.scene.bundle import frame_file, read_bundle
from dataset_factory.scene.devices import choose_devices
from dataset_factory.schedule.worker import Request, Task, trace_frame
from rfgs_core.radio import preset
from rfgs_core.schedule.archive import packed
from rfgs_core.schedule.workers import workers_here

MakeJob = Callable[..., Job]


@pytest.mark.slow
def test_memory_is_flat_over_300_frames(make_job: MakeJob, tmp_path: Path) -> None:
    bundle = tmp_path / "bundle"
    make_job(tmp_path).blender.run("export", "--out", str(bundle), "--frames", "1:4")
    devices, _ = choose_devices(read_bundle(bundle), preset("wifi"))
    request = Request(
        key="memory",
        radios={"wifi": asdict(preset("wifi"))},
        devices={"wifi": [asdict(device) for device in devices]},
        depth=1,
        shadow="kirchhoff",
        tracer="sionna",
        device="auto",
        seed=0,
        paths=False,
        versions=versions(),
    )
    scene, held, processes = packed(bundle, without="frames"), [], set()
    with workers_here(1, 16.0, tmp_path / "scratch", tmp_path) as workers:
        known = workers.client.scatter(scene)

        def submit(task: Task) -> Any:
            moving = frame_file(bundle, task.frame or 0).read_bytes()
            return workers.client.submit(trace_frame, request, known, moving, task, pure=False)

        tasks = [Task("wifi", 1 + turn % 4) for turn in range(300)]
        for _, answer in workers.answers(tasks, submit, doing="tracing"):
            held.append(answer.memory_bytes)
            processes.add(answer.worker)
    assert len(held) == 300 and len(processes) == 1
    # The first frames fill caches; after that a leak of 200 kB a frame would show.
    assert held[-1] - held[49] < 50e6, [held[49] / 1e6, held[-1] / 1e6]
    print(f"after 50 frames {held[49] / 1e6:.0f} MB, after 300 {held[-1] / 1e6:.0f} MB")  # noqa: T201
