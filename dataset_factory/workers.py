# SPDX-License-Identifier: Apache-2.0
"""Runs tracing tasks in several processes of this machine and collects their timings."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from dataset_factory.lane import Lane, Limits
from rfgs_core.errors import RfgsError

#: Share of the machine's memory that all tracing processes may take together.
_MEMORY_SHARE = 0.9


@dataclass(frozen=True)
class Task:
    """One frame of one radio."""

    radio: str
    """Preset name."""
    frame: int | None
    """Frame number; None is the static channel."""

    @property
    def request(self) -> dict[str, Any]:
        """What a tracing process is asked."""
        return {"radio": self.radio, "frame": self.frame, "file": None}

    def __str__(self) -> str:
        return f"{self.radio}, " + ("static" if self.frame is None else f"frame {self.frame}")


def limits(workers: int, worker_memory_gb: float) -> Limits:
    """What each of several processes may take.

    Args:
        workers: How many there are.
        worker_memory_gb: Memory of each [GB]; 0 shares the machine's.
    """
    share = psutil.virtual_memory().total * _MEMORY_SHARE / workers
    return Limits(int(worker_memory_gb * 1e9) if worker_memory_gb else int(share))


def run_tasks(
    job: dict[str, Any],
    tasks: list[Task],
    workers: int,
    limits: Limits,
    log_folder: Path,
    done: Callable[[Task, dict[str, Any]], None],
) -> dict[str, float]:
    """Traces all tasks; results are on disk as soon as `done` is called.

    Args:
        job: What every process needs, see `dataset_factory.worker`.
        tasks: What to trace; radio by radio, as loading a scene takes time.
        workers: Number of processes.
        limits: What each of them may take.
        log_folder: Where each process's own output goes.
        done: Called in this thread after each task, with `seconds` per stage and `memory_bytes`
            of the process that traced it.

    Returns:
        Seconds per stage, summed over processes.

    Raises:
        RfgsError: A task failed; the message is the task's own.
        OSError: A disk was full.
    """
    todo: queue.Queue[Task] = queue.Queue()
    for task in tasks:
        todo.put(task)
    results: queue.Queue[tuple[Task, dict[str, Any]]] = queue.Queue()
    log_folder.mkdir(parents=True, exist_ok=True)
    lanes = [
        Lane(job, log_folder / f"worker{index}.log", limits)
        for index in range(max(1, min(workers, len(tasks))))
    ]
    threads = [
        threading.Thread(target=_drive, args=(lane, todo, results), daemon=True) for lane in lanes
    ]
    seconds: Counter[str] = Counter()
    try:
        for thread in threads:
            thread.start()
        for _ in tasks:
            task, reply = results.get()
            if "error" in reply:
                raise failure(task, reply, log_folder)
            seconds.update(stages(task, reply))
            done(task, reply)
    finally:
        for lane in lanes:
            lane.end()
    return {name: round(value, 3) for name, value in sorted(seconds.items())}


def stages(task: Task, reply: dict[str, Any]) -> dict[str, float]:
    """Seconds per stage of one answer, by radio."""
    return {f"{task.radio}.{stage}": value for stage, value in reply["seconds"].items()}


def failure(task: Task, reply: dict[str, Any], log: Path | str) -> Exception:
    """What to raise for an answer that is an error."""
    if reply.get("errno"):
        return OSError(reply["errno"], reply["error"], reply["file"] or None)
    if not reply.get("crash"):
        return RfgsError(reply["error"])
    return RfgsError(f"tracing failed: {task}: {reply['error']}; the log is in {log}")


def _drive(
    lane: Lane, todo: queue.Queue[Task], results: queue.Queue[tuple[Task, dict[str, Any]]]
) -> None:
    reply: dict[str, Any] = {}
    while "error" not in reply:
        try:
            task = todo.get_nowait()
        except queue.Empty:
            return
        reply = lane.trace(task.request)
        results.put((task, reply))
