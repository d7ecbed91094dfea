# SPDX-License-Identifier: Apache-2.0
"""Where work is spread: over processes of this machine, or over a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rfgs_core.errors import RfgsError
from rfgs_core.links import refuse_link
from rfgs_core.schedule.workers import Workers, workers_here, workers_of


@dataclass(frozen=True)
class Spread:
    """Who works."""

    workers: int = 1
    """Processes of this machine."""
    memory_gb: float = 0.0
    """Memory that each of them may take [GB]; 0 shares the machine's."""
    scheduler: str = ""
    """Address of a Dask scheduler whose workers do it instead; empty for this machine."""

    def check(self) -> None:
        """Refuses numbers that no machine has.

        Raises:
            RfgsError: A number is out of range.
        """
        if not 1 <= self.workers <= 256:
            raise RfgsError(f"--workers {self.workers}: expected 1 to 256")
        if not 0.0 <= self.memory_gb <= 1e4:
            raise RfgsError(f"--worker-memory {self.memory_gb}: expected GB, or 0")

    @contextmanager
    def ready(
        self, tasks: int, scratch: Path, log: Path, leave: Callable[[], None] | None = None
    ) -> Iterator[Workers]:
        """Workers until the block ends.

        Args:
            tasks: How many tasks there are; more processes than that are not started.
            scratch: Folder for what processes of this machine keep meanwhile.
            log: Folder of their logs; those of an earlier run are removed.
            leave: What each worker of a cluster does when the block ends.

        Raises:
            RfgsError: No process starts, or there is no such cluster.
        """
        if self.scheduler:
            with workers_of(self.scheduler, leave) as workers:
                yield workers
            return
        refuse_link(log)
        log.mkdir(parents=True, exist_ok=True)
        for old in log.glob("worker*.log"):
            old.unlink()
        with workers_here(min(self.workers, tasks), self.memory_gb, scratch, log) as workers:
            yield workers
