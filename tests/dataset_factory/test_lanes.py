# SPDX-License-Identifier: Apache-2.0
"""Tracing processes that die, grow or are replaced cost time and nothing else."""

from __future__ import annotations

import sys
from pathlib import Path

import psutil
import pytest

from dataset_factory import tracing_process
from dataset_factory.lane import Lane, Limits
from dataset_factory.workers import Task, limits, run_tasks
from rfgs_core.errors import RfgsError

GB = 10**9

#: A process that speaks the protocol of `dataset_factory.worker` and misbehaves on request.
MISBEHAVING = """
import json, os, signal, sys, time
refused = "refuse" in json.loads(sys.stdin.readline())
print(json.dumps({"error": "no such scene"} if refused else {"ready": True}), flush=True)
marks = os.environ["MARKS"]
hoard = []
for line in sys.stdin:
    request = json.loads(line)
    frame = request["frame"]
    with open(marks, "a") as file:
        file.write(f"{frame}\\n")
    tried = open(marks).read().split().count(str(frame))
    if frame == 13 or (frame == 5 and tried == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    if frame == 99:
        hoard.append(bytearray(os.urandom(1)) * 400_000_000)
        time.sleep(60)
    if frame == 7:
        hoard.append(bytearray(os.urandom(1)) * 120_000_000)
    print(json.dumps({"seconds": {"people": 1.0}}), flush=True)
"""


@pytest.fixture
def misbehaving(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Puts such a process in the worker's place; returns the list of frames it was asked for."""
    program, marks = tmp_path / "program.py", tmp_path / "marks"
    program.write_text(MISBEHAVING)
    marks.touch()
    monkeypatch.setenv("MARKS", str(marks))
    popen = tracing_process.subprocess.Popen

    def start(_command: list[str], **options: object) -> object:
        return popen([sys.executable, str(program)], **options)  # type: ignore[call-overload]

    monkeypatch.setattr(tracing_process.subprocess, "Popen", start)
    return marks


def run(tmp_path: Path, frames: list[int], memory_bytes: int = GB) -> list[int]:
    tasks = [Task("wifi", frame) for frame in frames]
    finished: list[int] = []
    run_tasks(
        {},
        tasks,
        2,
        Limits(memory_bytes),
        tmp_path,
        lambda task, _reply: finished.append(task.frame or 0),
    )
    return sorted(finished)


def asked(marks: Path) -> list[int]:
    return sorted(int(frame) for frame in marks.read_text().split())


def test_a_process_that_dies_costs_its_frame_one_try(tmp_path: Path, misbehaving: Path) -> None:
    assert run(tmp_path, [3, 4, 5, 6]) == [3, 4, 5, 6]
    assert asked(misbehaving) == [3, 4, 5, 5, 6]


def test_a_frame_that_kills_twice_is_named(tmp_path: Path, misbehaving: Path) -> None:
    with pytest.raises(RfgsError, match="wifi, frame 13: a tracing process ended with code -9"):
        run(tmp_path, [13])
    assert asked(misbehaving) == [13, 13]


def test_a_process_that_grows_is_killed_and_named(tmp_path: Path, misbehaving: Path) -> None:
    message = r"wifi, frame 99: a tracing process took more than 0.3 GB; raise --worker-memory"
    with pytest.raises(RfgsError, match=message):
        run(tmp_path, [99], memory_bytes=300_000_000)
    assert asked(misbehaving) == [99, 99]


def test_nothing_is_left_running(tmp_path: Path, misbehaving: Path) -> None:
    with pytest.raises(RfgsError):
        run(tmp_path, [1, 2, 13, 4])
    assert [child for child in psutil.Process().children() if child.status() != "zombie"] == []


def test_a_process_is_replaced_between_frames_when_it_is_nearly_full(
    tmp_path: Path, misbehaving: Path
) -> None:
    lane = Lane({}, tmp_path / "log", Limits(150_000_000))
    started, memory_bytes = [], []
    for frame in (1, 2, 7, 3, 4):
        memory_bytes.append(lane.trace(Task("wifi", frame).request)["memory_bytes"])
        started.append(lane.started)
    lane.end()
    assert started == [1, 1, 1, 2, 2]
    assert memory_bytes[2] > 120_000_000 > 2 * max(memory_bytes[1], memory_bytes[3])


def test_a_process_is_replaced_after_so_many_frames(tmp_path: Path, misbehaving: Path) -> None:
    lane = Lane({}, tmp_path / "log", Limits(GB, frames=2))
    for frame in range(5):
        lane.trace(Task("wifi", frame).request)
    lane.end()
    assert lane.started == 3


def test_a_lane_that_has_ended_starts_nothing(tmp_path: Path, misbehaving: Path) -> None:
    lane = Lane({}, tmp_path / "log", Limits(GB))
    lane.trace(Task("wifi", 1).request)
    lane.end()
    assert "error" in lane.trace(Task("wifi", 2).request)
    assert lane.started == 1


def test_a_process_that_could_not_begin_is_not_asked_again(
    tmp_path: Path, misbehaving: Path
) -> None:
    lane = Lane({"refuse": True}, tmp_path / "log", Limits(GB))
    answers = [lane.trace(Task("wifi", frame).request) for frame in (1, 2)]
    lane.end()
    assert answers == [{"error": "no such scene"}] * 2
    assert asked(misbehaving) == []


def test_workers_share_the_memory_of_the_machine() -> None:
    total = psutil.virtual_memory().total
    assert limits(4, 0.0).memory_bytes == pytest.approx(0.9 * total / 4, rel=1e-6)
    assert limits(4, 2.5).memory_bytes == 2_500_000_000
