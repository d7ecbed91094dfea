# SPDX-License-Identifier: Apache-2.0
"""Runs tracing tasks in several processes and collects their timings."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from dataset_factory.children import child_environment, end_with_parent
from rfgs_core.errors import RfgsError

#: One library's worker pool inside each process would make processes fight for cores.
_SINGLE_THREADED = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}


@dataclass(frozen=True)
class Task:
    """One frame of one radio."""

    radio: str
    """Preset name."""
    frame: int | None
    """Frame number; None is the static channel."""


def run_tasks(
    job: dict[str, Any],
    tasks: list[Task],
    workers: int,
    log_folder: Path,
    done: Callable[[Task], None],
) -> dict[str, float]:
    """Traces all tasks; results are on disk as soon as `done` is called.

    Args:
        job: What every worker needs, see `dataset_factory.worker`.
        tasks: What to trace; radio by radio, as loading a scene takes time.
        workers: Number of processes.
        log_folder: Where each process's own output goes.
        done: Called in this thread after each task.

    Returns:
        Seconds per stage, summed over processes.

    Raises:
        RfgsError: A task failed; the message is the task's own.
        OSError: A disk was full.
    """
    todo: queue.Queue[Task] = queue.Queue()
    for task in tasks:
        todo.put(task)
    results: queue.Queue[tuple[Task | None, dict[str, Any]]] = queue.Queue()
    log_folder.mkdir(parents=True, exist_ok=True)
    count = max(1, min(workers, len(tasks)))
    logs = [(log_folder / f"worker{index}.log").open("w") for index in range(count)]
    processes = [_start(log) for log in logs]
    threads = [
        threading.Thread(target=_drive, args=(process, job, todo, results), daemon=True)
        for process in processes
    ]
    seconds: dict[tuple[int, str, str], float] = {}
    try:
        for thread in threads:
            thread.start()
        finished = 0
        while finished < len(tasks):
            task, reply = results.get()
            if "error" in reply:
                raise _failure(task, reply, log_folder)
            if task is None:
                continue
            finished += 1
            for stage, value in reply["seconds"].items():
                seconds[reply["worker"], task.radio, stage] = value
            done(task)
    finally:
        for process in processes:
            process.terminate()
        for process, log in zip(processes, logs, strict=True):
            process.wait()
            log.close()
    return _summed(seconds)


def _start(log: IO[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "dataset_factory.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        env=child_environment(**_SINGLE_THREADED),
        # Ctrl-C reaches the parent alone, which then ends its workers.
        start_new_session=True,
        preexec_fn=end_with_parent,
    )


def _drive(
    process: subprocess.Popen[str],
    job: dict[str, Any],
    todo: queue.Queue[Task],
    results: queue.Queue[tuple[Task | None, dict[str, Any]]],
) -> None:
    reply = _ask(process, job)
    results.put((None, reply))
    while "error" not in reply:
        try:
            task = todo.get_nowait()
        except queue.Empty:
            return
        reply = _ask(process, {"radio": task.radio, "frame": task.frame})
        results.put((task, {**reply, "worker": process.pid}))


def _ask(process: subprocess.Popen[str], request: dict[str, Any]) -> dict[str, Any]:
    assert process.stdin is not None and process.stdout is not None
    try:
        process.stdin.write(json.dumps(request) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
    except (BrokenPipeError, ValueError):
        line = ""
    if line.endswith("\n"):
        return json.loads(line)
    return {"error": f"a tracing process ended with code {process.wait()}", "crash": True}


def _failure(task: Task | None, reply: dict[str, Any], log_folder: Path) -> Exception:
    if reply.get("errno"):
        return OSError(reply["errno"], reply["error"], reply["file"] or None)
    if not reply.get("crash"):
        return RfgsError(reply["error"])
    where = f"{task.radio}, frame {task.frame or 'static'}: " if task else ""
    return RfgsError(f"tracing failed: {where}{reply['error']}; the log is in {log_folder}")


def _summed(seconds: dict[tuple[int, str, str], float]) -> dict[str, float]:
    total: dict[str, float] = {}
    for (_, radio, stage), value in sorted(seconds.items()):
        key = f"{radio}.{stage}"
        total[key] = round(total.get(key, 0.0) + value, 3)
    return total
