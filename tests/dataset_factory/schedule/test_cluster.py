# SPDX-License-Identifier: Apache-2.0
"""Who traces does not show in the data: one process, two, or a cluster that loses a worker."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from dataset_factory.make.generate import generate
from dataset_factory.plan.contents import versions
from dataset_factory.plan.job import Job
from rfgs_core.errors import RfgsError

MakeJob = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]
Bytes = Callable[[Path], dict[str, bytes]]
StartCluster = Callable[..., AbstractContextManager[Any]]


def kill_when(sign: Path, pid: int, killed: threading.Event) -> threading.Thread:
    """Kills a process as soon as a file appears."""

    def watch() -> None:
        while not sign.exists():
            time.sleep(0.01)
        os.kill(pid, signal.SIGKILL)
        killed.set()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


@pytest.mark.slow
def test_one_worker_two_workers_and_a_cluster_that_loses_one_give_the_same_bytes(
    make_job: MakeJob, data_of: Bytes, cluster: Any, tmp_path: Path
) -> None:
    common = {"frames": "1:4", "images": False}
    folders = [tmp_path / name for name in ("one", "two", "cluster")]
    assert generate(make_job(folders[0], workers=1, **common))
    assert generate(make_job(folders[1], workers=2, **common))
    killed = threading.Event()
    sign = folders[2] / "box_room/radio/wifi/done/static"
    kill_when(sign, cluster.workers[0].pid, killed)
    address = cluster.scheduler_address
    assert generate(make_job(folders[2], scheduler=address, **common))
    assert killed.is_set()
    one, two, spread = (data_of(folder) for folder in folders)
    assert one == two
    assert one == spread


@pytest.mark.slow
def test_plan_tells_the_pace_of_a_cluster(
    factory: Factory, box_room: Path, cluster: Any, tmp_path: Path
) -> None:
    arguments = [str(box_room), "--radio", "wifi", "--frames", "1:4", "--no-images"]
    arguments += ["--depth", "1", "--out", str(tmp_path / "out")]
    arguments += ["--scheduler", cluster.scheduler_address]
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    commands = ("plan", "generate", "plan")
    answers = [factory(command, *arguments, **cache) for command in commands]
    assert [answer.returncode for answer in answers] == [0, 0, 0], answers[1].stderr
    assert "frames  4, 0 cameras, 0 pictures, 2 workers" in answers[0].stdout
    assert f"on {cluster.scheduler_address}: estimated from usual speeds" in answers[0].stdout
    assert "trace wifi estimated" not in answers[2].stdout


@pytest.mark.slow
def test_workers_with_other_versions_are_refused(
    make_job: MakeJob, cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {**versions(), "sionna-rt": "0.0.1"}
    monkeypatch.setattr("dataset_factory.schedule.channels.versions", lambda: wanted)
    job = make_job(tmp_path / "out", images=False, scheduler=cluster.scheduler_address)
    with pytest.raises(RfgsError, match=r"a worker of the cluster has sionna-rt 2.2.0, this"):
        generate(job)


def test_an_address_without_a_scheduler_is_named(
    make_job: MakeJob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rfgs_core.schedule.workers._PATIENCE_S", 1)
    job = make_job(tmp_path / "out", images=False, scheduler="tcp://127.0.0.1:9")
    with pytest.raises(RfgsError, match=r"--scheduler tcp://127.0.0.1:9: no Dask scheduler"):
        generate(job)
    assert not (tmp_path / "out").exists(), "nothing is exported for nobody"


def test_workers_of_several_threads_are_refused(
    make_job: MakeJob, start_cluster: StartCluster, tmp_path: Path
) -> None:
    with start_cluster(tmp_path, threads=2) as cluster:
        job = make_job(tmp_path / "out", images=False, scheduler=cluster.scheduler_address)
        with pytest.raises(RfgsError, match=r"has 2 threads, .* --nworkers 2 --nthreads 1"):
            generate(job)
    assert not (tmp_path / "out").exists(), "nothing is exported for nobody"
