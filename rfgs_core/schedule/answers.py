# SPDX-License-Identifier: Apache-2.0
"""What workers have in common: how they begin, what they answer, and when another goes on.

A worker is a process with one thread, since Dr.Jit and numba run best so. It shares nothing with
the process that hands out the work.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import psutil

from rfgs_core.children import end_with_parent
from rfgs_core.errors import RfgsError

V = TypeVar("V")

#: Tasks after which a worker asks for another process: a start costs seconds.
FRESH_AFTER_TASKS = 300
#: Share of its memory limit beyond which it asks for one.
FRESH_AFTER_SHARE = 0.8


@dataclass(frozen=True)
class Answer(Generic[V]):
    """What a worker has to say of a task."""

    value: V
    """What was made."""
    seconds: dict[str, float]
    """Time spent on it per stage [s]."""
    memory_bytes: int
    """Memory of the process after it [B]."""
    worker: str
    """Address of the worker."""
    wants_fresh_process: bool
    """Whether the worker has done, or holds, so much that another process should go on."""


def answer_of(worker: Any, value: V, seconds: dict[str, float], done: int) -> Answer[V]:
    """The answer of a worker, with what it holds now; `done` is how many tasks it has done."""
    memory_bytes = psutil.Process().memory_info().rss
    fresh = wants_fresh_process(memory_bytes, worker.memory_manager.memory_limit, done)
    return Answer(value, seconds, memory_bytes, worker.address, fresh)


def wants_fresh_process(memory_bytes: int, limit_bytes: int | None, done: int) -> bool:
    """Whether a worker that holds so much after so many tasks should be replaced."""
    full = bool(limit_bytes) and memory_bytes > FRESH_AFTER_SHARE * limit_bytes
    return full or done >= FRESH_AFTER_TASKS


def refuse_other_versions(here: Mapping[str, str], wanted: Mapping[str, str]) -> None:
    """Refuses to work with other packages than those of the process that asks.

    Args:
        here: Version of each package in this worker.
        wanted: Those of the process that asks.

    Raises:
        RfgsError: Naming the first package that differs.
    """
    for name, version in here.items():
        if version != wanted.get(name):
            raise RfgsError(
                f"a worker of the cluster has {name} {version}, this machine "
                f"{wanted.get(name, 'none')}; bytes would depend on who made them, so install the "
                "same everywhere"
            )


def begin(log: Path) -> None:
    """Makes this process a quiet child: libraries print to a file, and it ends with its parent."""
    end_with_parent()
    with log.open("a") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
