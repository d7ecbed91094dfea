# SPDX-License-Identifier: Apache-2.0
"""Who makes random worlds does not show in them: this process, two others, or a cluster."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dataset_factory.cli import main
from rfgs_core.files import sha256

Factory = Callable[..., subprocess.CompletedProcess[str]]

ASKED = ("worlds", "--radio", "wifi_commodity", "--frames", "2", "--depth", "1")
FOUR = (*ASKED, "--count", "4")


def digests(out: Path) -> dict[str, str]:
    """Of the worlds and of what they have in common, without logs and locks."""
    found = [out / "worlds.json", *out.glob("world_*/**/*")]
    return {path.relative_to(out).as_posix(): sha256(path) for path in found if path.is_file()}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Four worlds by one process."""
    out = tmp_path_factory.mktemp("worlds") / "alone"
    assert main([*FOUR, "--out", str(out)]) == 0
    return digests(out)


@pytest.mark.slow
def test_two_workers_make_the_same_worlds(two_worlds: Path, tmp_path: Path) -> None:
    out = tmp_path / "two"
    assert main([*ASKED, "--count", "2", "--workers", "2", "--out", str(out)]) == 0
    assert digests(out) == digests(two_worlds)
    assert sorted(path.name for path in (out / "log/0-1").iterdir()) == [
        "worker0.log",
        "worker1.log",
    ]
    assert not list(out.glob(".work*")) and not list(out.glob(".tmp*"))


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_makes_the_same_worlds(
    alone: dict[str, str], cluster: Any, tmp_path: Path
) -> None:
    out = tmp_path / "cluster"
    command = [*FOUR, "--scheduler", cluster.scheduler_address, "--out", str(out)]
    with subprocess.Popen([sys.executable, "-m", "dataset_factory", *command]) as process:
        while process.poll() is None and not list(out.glob("world_*")):
            time.sleep(0.01)
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        assert process.wait() == 0
    assert digests(out) == alone


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_stopped_workers_go_on_to_the_same_worlds(
    alone: dict[str, str], tmp_path: Path, number: signal.Signals
) -> None:
    out, log = tmp_path / "stopped", tmp_path / "log"
    command = [sys.executable, "-m", "dataset_factory", *FOUR, "--workers", "2", "--out", str(out)]
    with log.open("w") as stream:
        process = subprocess.Popen(command, stderr=stream, stdout=subprocess.DEVNULL)
    while process.poll() is None and not list(out.glob("world_*")):
        time.sleep(0.005)
    process.send_signal(number)
    code = process.wait()
    if number == signal.SIGINT:
        assert code in (0, 130) and "Traceback" not in log.read_text()
        assert code == 0 or log.read_text().count("stopped; finished work is kept") == 1
    kept = {name: value for name, value in digests(out).items() if name in alone}
    assert kept.items() <= alone.items(), "a world is whole or not there"
    assert main([*FOUR, "--workers", "2", "--out", str(out)]) == 0
    assert digests(out) == alone
    assert not list(out.glob(".work*")) and not list(out.glob(".tmp*"))


def test_workers_that_are_not_there_are_named_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rfgs_core.schedule.workers._PATIENCE_S", 1)
    out = tmp_path / "out"
    for more, said in (
        (("--scheduler", "tcp://127.0.0.1:9"), "no Dask scheduler answers there"),
        (("--workers", "0"), "--workers 0: expected 1 to 256"),
        (("--worker-memory", "-1"), "--worker-memory -1.0: expected GB"),
    ):
        assert main([*FOUR, *more, "--out", str(out)]) != 0
        assert said in capsys.readouterr().err
    assert not out.exists()


def test_a_world_that_no_room_has_is_named_by_workers_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    radio = tmp_path / "coarse.yaml"
    radio.write_text("like: wifi_commodity\nnum_subcarriers: 4\n")
    out = tmp_path / "out"
    command = [*FOUR, "--radio", str(radio), "--workers", "2", "--out", str(out)]
    assert main(command) != 0
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("error: world ") and ": none of 40 rooms has space" in error
    assert not list(out.glob("world_*")) and not list(out.glob(".work*"))
