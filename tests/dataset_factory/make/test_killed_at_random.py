# SPDX-License-Identifier: Apache-2.0
"""`kill -9` at twenty random moments, each resumed: the data are those of an undisturbed run."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from dataset_factory.check.validate import validate

Bytes = Callable[[Path], dict[str, bytes]]

KILLS = 20
#: Whole runs of this small scene take about as long [s].
LONGEST_S = 15.0


def start(box_room: Path, out: Path, log: Path) -> subprocess.Popen[bytes]:
    """A run in a process group of its own that has begun to run the program."""
    command = [sys.executable, "-m", "dataset_factory", "generate", str(box_room)]
    command += ["--radio", "wifi", "--frames", "1:2", "--cameras", "1", "--resolution", "32"]
    command += ["--samples", "2", "--depth", "1", "--workers", "2", "--out", str(out)]
    with log.open("w") as stream:
        process = subprocess.Popen(
            command, stdout=stream, stderr=stream, start_new_session=True, cwd=out.parent
        )
    while process.poll() is None and not log.stat().st_size:
        time.sleep(0.01)
    return process


def strike(process: subprocess.Popen[bytes], target: str) -> str:
    """Kills one process or all of them; returns what was hit."""
    children = psutil.Process(process.pid).children(recursive=True)
    if target == "child" and children:
        victim = random.choice(children)
        victim.kill()
        return "child"
    if target == "all":
        for child in children:
            child.kill()
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    # Children that were spared end with their parent, or soon after.
    psutil.wait_procs(children, timeout=30)
    return target


@pytest.mark.slow
def test_twenty_random_kills_leave_no_trace(
    box_room: Path, box_dataset: Path, data_of: Bytes, tmp_path: Path
) -> None:
    random.seed(20)
    out, log = tmp_path / "dataset", tmp_path / "log"
    undisturbed = data_of(box_dataset)
    process = start(box_room, out, log)
    hits: list[str] = []
    finished = 0
    while len(hits) < KILLS or process.poll() is None:
        end = time.monotonic() + (random.uniform(0.0, LONGEST_S) if len(hits) < KILLS else 600.0)
        while process.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        if process.poll() is None:
            hits.append(strike(process, random.choice(["parent", "all", "child"])))
            if process.poll() is None:
                continue
        elif process.returncode == 0:
            assert data_of(out) == undisturbed
            finished += 1
            if len(hits) == KILLS:
                break
            shutil.rmtree(out)
        else:
            # The same child was hit twice, or Blender was: one line says so.
            assert process.returncode == 2, log.read_text()
            assert "Traceback" not in log.read_text()
        process = start(box_room, out, log)
    assert process.wait() == 0, log.read_text()
    assert len(hits) == KILLS and {"parent", "child"} <= set(hits)
    assert data_of(out) == undisturbed
    assert validate(out) == []
