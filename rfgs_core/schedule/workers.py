# SPDX-License-Identifier: Apache-2.0
"""Workers: processes of this machine, or those of a Dask cluster that the user names.

Either way Dask hands out the tasks, watches memory, and gives the task of a worker that died to
another.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import psutil

from rfgs_core.errors import RfgsError
from rfgs_core.schedule.answers import Answer

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

T = TypeVar("T")

#: How long to wait for a scheduler and for a first worker [s].
_PATIENCE_S = 30
#: How long workers that were killed may take to be counted as gone [s].
_GOODBYE_S = 5
#: Share of the machine's memory that all its workers may take together.
_MEMORY_SHARE = 0.9

#: One library's worker pool inside each process would make processes fight for cores.
#: What these read when NumPy is imported, Dask sets in this process too, and leaves there.
_SINGLE_THREADED = {f"{name}_NUM_THREADS": 1 for name in ("OMP", "OPENBLAS", "MKL")}
#: Dask's settings for workers of this machine.
_HERE = {
    # A task is tried twice.
    "distributed.scheduler.allowed-failures": 1,
    # Compilers hold Python's lock for minutes; a process that is gone shows without that.
    "distributed.scheduler.worker-ttl": None,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # The limit kills; nothing else happens before.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 1.0,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.multiprocessing-method": "spawn",
    "distributed.nanny.pre-spawn-environ": _SINGLE_THREADED,
    # Left in this process, it would end the next compilation here: numba reads it again.
    "distributed.nanny.environ": {"NUMBA_NUM_THREADS": 1},
}


@dataclass(frozen=True)
class Workers:
    """Workers that are ready."""

    client: Client
    """Hands them work."""
    count: int
    """How many there are."""
    place: str
    """Where, for messages."""
    ours: bool
    """Whether they work for this run alone."""

    def answers(
        self, tasks: Sequence[T], submit: Callable[[T], Future], doing: str
    ) -> Iterator[tuple[T, Answer[Any]]]:
        """Has tasks done, in any order.

        Args:
            tasks: What to do.
            submit: Submits a task that ends in an `Answer`.
            doing: What is being done, for messages.

        Raises:
            RfgsError: A task failed, lost its worker too often, or the cluster is gone.
        """
        from distributed import as_completed

        waiting, task_of = iter(tasks), {}

        def start(task: T) -> Future:
            future = submit(task)
            task_of[future.key] = task
            return future

        # On a cluster one more is under way, so that no worker waits for the network.
        first = islice(waiting, self.count * (1 if self.ours else 2))
        running = as_completed([start(task) for task in first])
        for future in running:
            task = task_of.pop(future.key)
            answer = self._answer(future, f"{doing} failed: {task}")
            # Whatever is still wanted of a worker that goes would be made again.
            future.release()
            if answer.wants_fresh_process and self.ours:
                self.client.restart_workers([answer.worker], raise_for_error=False)
            running.update([start(following) for following in islice(waiting, 1)])
            yield task, answer

    def _answer(self, future: Future, failed: str) -> Answer[Any]:
        from distributed import KilledWorker

        if future.status == "cancelled":
            raise RfgsError(
                f"--scheduler {self.place}: the scheduler is gone; what is finished is kept, run "
                "the same command to continue"
            )
        try:
            answer: Any = future.result()
        except RfgsError:
            raise
        except KilledWorker as error:
            tries = error.allowed_failures + 1
            often = "twice" if tries == 2 else f"{tries} times"
            raise RfgsError(
                f"{failed}: {self._cause(error.last_worker)} (tried {often}); "
                f"the log is in {self.place}"
            ) from error
        except Exception as error:
            if isinstance(error, OSError) and error.errno:
                # Such as a full disk; those of connections have no number.
                raise
            raise RfgsError(
                f"{failed}: {type(error).__name__}: {error}; the log is in {self.place}"
            ) from error
        return answer

    def _cause(self, lost: Any) -> str:
        """Why a worker was lost, as far as that is known."""
        events: Any = self.client.get_events("worker-restart-memory")
        if any(event["worker"] == lost.address for _, event in events):
            remedy = (
                "raise --worker-memory or lower --workers"
                if self.ours
                else "start the workers with a higher --memory-limit"
            )
            return f"a worker took more than {lost.memory_limit / 1e9:.1f} GB; {remedy}"
        return "its worker died"


@contextmanager
def workers_here(count: int, memory_gb: float, scratch: Path, log: Path) -> Iterator[Workers]:
    """Processes of this machine that end with the block, and with this process.

    Args:
        count: How many.
        memory_gb: Memory of each [GB], beyond which it is killed; 0 shares the machine's.
        scratch: Folder for what they keep meanwhile.
        log: Folder of their logs, for messages.

    Raises:
        RfgsError: They do not start.
    """
    import dask.config
    from distributed import Client, LocalCluster

    _hush()
    with dask.config.set({**_HERE, "temporary-directory": str(scratch)}):
        try:
            with _interrupts_held_back():
                cluster = LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False},
                    worker_dashboard_address=None,
                    memory_limit=memory_bytes(count, memory_gb),
                    local_directory=str(scratch),
                    silence_logs=logging.WARNING,
                )
        except RuntimeError as error:
            raise RfgsError(f"no worker process starts: {error}") from error
        try:
            with Client(cluster) as client:
                # A worker that dies while it starts is replaced too.
                adaptive = cluster.adapt(minimum=count, maximum=count)
                try:
                    yield Workers(client, count, str(log), ours=True)
                finally:
                    adaptive.stop()
                    _kill(cluster)
        finally:
            # It would wait, without end, for a replacement that was just being started.
            with suppress(TimeoutError):
                cluster.close(timeout=_GOODBYE_S)
            _kill(cluster)


def memory_bytes(workers: int, memory_gb: float) -> int:
    """What each of several workers may take [B].

    Args:
        workers: How many there are.
        memory_gb: Memory of each [GB]; 0 shares the machine's.
    """
    share = psutil.virtual_memory().total * _MEMORY_SHARE / workers
    return int(memory_gb * 1e9) if memory_gb else int(share)


@contextmanager
def workers_of(address: str, leave: Callable[[], None] | None = None) -> Iterator[Workers]:
    """The workers of a cluster.

    Args:
        address: Its scheduler's, as in `tcp://node1:8786`.
        leave: What each worker does when the block ends.

    Raises:
        RfgsError: There is no such cluster, or no worker of one thread.
    """
    from distributed import Client

    _hush()
    try:
        client = Client(address, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        raise RfgsError(
            f"--scheduler {address}: no Dask scheduler answers there ({error}); start one with "
            "`dask scheduler` and take the address it prints"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError as error:
            raise RfgsError(
                f"--scheduler {address}: it has no workers; start some with "
                f"`dask worker {address} --nworkers 4 --nthreads 1`"
            ) from error
        of_worker: Any = client.nthreads()
        for worker, threads in of_worker.items():
            if threads > 1:
                raise RfgsError(
                    f"--scheduler {address}: worker {worker} has {threads} threads, and work is "
                    f"done in one; start it with --nworkers {threads} --nthreads 1"
                )
        try:
            yield Workers(client, max(len(of_worker), 1), address, ours=False)
        finally:
            if leave is not None:
                with suppress(OSError):
                    client.run(leave)


def count_workers(address: str) -> int:
    """How many tasks a cluster does at the same time.

    Raises:
        RfgsError: There is no such cluster, or no worker of one thread.
    """
    with workers_of(address) as workers:
        return workers.count


def _hush() -> None:
    """Keeps Dask's log off the terminal: lost workers are told by what becomes of their tasks."""
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    quiet = "ignore:resource_tracker"
    if quiet not in sys.warnoptions:
        # For multiprocessing's own process: it would count what a killed run has left.
        sys.warnoptions.append(quiet)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Ctrl-C waits for the block to end, and never reaches threads and processes begun in it.

    A terminal sends it to the whole group of processes: the command alone shall answer.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _kill(cluster: LocalCluster) -> None:
    """Ends workers at once: they have nothing to keep, and a task may take minutes."""
    for nanny in cluster.workers.values():
        nanny.close_gracefully()
        if nanny.pid:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGKILL)
