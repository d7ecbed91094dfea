# SPDX-License-Identifier: Apache-2.0
"""A tracing process holds no more after 300 frames than after 50."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pytest

from dataset_factory.bundle import read_bundle
from dataset_factory.devices import choose_devices
from dataset_factory.job import Job
from dataset_factory.lane import Lane, Limits
from rfgs_core.radio import preset

MakeJob = Callable[..., Job]


@pytest.mark.slow
def test_memory_is_flat_over_300_frames(make_job: MakeJob, tmp_path: Path) -> None:
    bundle = tmp_path / "bundle"
    make_job(tmp_path).blender.run("export", "--out", str(bundle), "--frames", "1:4")
    devices, _ = choose_devices(read_bundle(bundle), preset("wifi"))
    job = {
        "bundle": str(bundle),
        "radios": {"wifi": asdict(preset("wifi"))},
        "devices": {"wifi": [asdict(device) for device in devices]},
        "depth": 1,
        "shadow": "kirchhoff",
        "paths": False,
        "seed": 0,
    }
    lane = Lane(job, tmp_path / "log", Limits(16 * 10**9, frames=1000))
    held = []
    for turn in range(300):
        request = {"radio": "wifi", "frame": 1 + turn % 4, "file": str(tmp_path / "value.npy")}
        reply = lane.trace(request)
        assert "error" not in reply, reply
        held.append(reply["memory_bytes"])
    lane.end()
    assert lane.started == 1
    # The first frames fill caches; after that a leak of 200 kB a frame would show.
    assert held[-1] - held[49] < 50e6, [held[49] / 1e6, held[-1] / 1e6]
    print(f"after 50 frames {held[49] / 1e6:.0f} MB, after 300 {held[-1] / 1e6:.0f} MB")  # noqa: T201
