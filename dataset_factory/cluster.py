# SPDX-License-Identifier: Apache-2.0
"""Traces on a Dask cluster: scenes go along with the tasks and channels come back.

Nothing has to be shared between the machines, and only this process writes the dataset: a
worker that dies takes its frame with it and nothing else, and Dask gives the frame to another.
Every thread of a Dask worker drives a tracing process of its own, since Dr.Jit and numba run
best with one thread per process and must not take the worker down with them.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
import socket
import tarfile
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dataset_factory.lane import Lane, Limits
from dataset_factory.plan import versions
from dataset_factory.workers import Task, failure, stages
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.files import read_json, write_bytes

if TYPE_CHECKING:
    from distributed import Client, Future

#: How long to wait for the scheduler and for a first worker [s].
_PATIENCE_S = 30
#: Frames that wait at the scheduler for each thread of the cluster.
_AHEAD = 2

#: What each thread of a Dask worker keeps, by thread.
_PLACES: dict[int, _Place] = {}


def run_on_cluster(
    address: str,
    job: dict[str, Any],
    tasks: list[Task],
    limits: Limits,
    done: Callable[[Task, dict[str, Any]], None],
) -> dict[str, float]:
    """Traces all tasks; results are on disk as soon as `done` is called.

    Args:
        address: The scheduler's, as in `tcp://node1:8786`.
        job: What every tracing process needs, see `dataset_factory.worker`.
        tasks: What to trace.
        limits: What each tracing process may take.
        done: Called in this thread after each task, as in `workers.run_tasks`.

    Returns:
        Seconds per stage, summed over processes.

    Raises:
        MissingToolError: Dask is not installed.
        RfgsError: There is no such cluster, or a task failed on it.
        OSError: A disk was full.
    """
    seconds: Counter[str] = Counter()
    store = _Store(job)
    with _connected(address) as client:
        from distributed import as_completed

        scene = client.submit(bytes, _packed(Path(job["bundle"])), key=f"scene-{store.key}")
        waiting = iter(tasks)

        def submit(task: Task) -> Future:
            frame = store.frame_file(task)
            moving = frame.read_bytes() if frame else b""
            future = client.submit(
                _trace_here, store.key, scene, store.job, moving, task, limits, versions(),
                pure=False,
            )  # fmt: skip
            of_future[future.key] = task
            return future

        of_future: dict[Any, Task] = {}
        # Enough that no thread waits.
        first = islice(waiting, _AHEAD * _threads(client))
        running = as_completed([submit(task) for task in first])
        for future in running:
            task = of_future.pop(future.key)
            reply = _answer(future, task, address)
            store.write(task, reply.pop("value"), reply.pop("paths"))
            seconds.update(stages(task, reply))
            done(task, reply)
            for following in islice(waiting, 1):
                running.add(submit(following))
    return {name: round(value, 3) for name, value in sorted(seconds.items())}


def threads(address: str) -> int:
    """How many frames a cluster traces at the same time.

    Raises:
        MissingToolError: Dask is not installed.
        RfgsError: There is no such cluster.
    """
    with _connected(address) as client:
        return _threads(client)


class _Store:
    """The sequence on this side of the cluster."""

    def __init__(self, job: dict[str, Any]) -> None:
        self._bundle = Path(job["bundle"])
        self._files = SequenceFiles(Path(job["sequence"]))
        self._frames = [int(frame) for frame in read_json(self._bundle / "bundle.json")["frames"]]
        self.job = {key: job[key] for key in job if key not in ("bundle", "sequence")}
        self.key = hashlib.sha256(
            (self._bundle / "bundle.json").read_bytes() + json.dumps(job, sort_keys=True).encode()
        ).hexdigest()

    def frame_file(self, task: Task) -> Path | None:
        """What moves at a task's frame."""
        return None if task.frame is None else _frame_file(self._bundle, task.frame)

    def write(self, task: Task, value: np.ndarray, paths: bytes) -> None:
        """Writes the table of paths, if there is one, then a channel and its marker."""
        if paths:
            write_bytes(self._files.paths(task.radio, task.frame), paths)
        index = None if task.frame is None else self._frames.index(task.frame)
        marker = self._files.csi_done(task.radio, task.frame)
        write_csi(self._files.csi(task.radio), index, value, marker)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """A client of a cluster that has workers."""
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingToolError(
            "--scheduler needs Dask's distributed; install it: pip install 'rfgs[cluster]'"
        ) from error
    # Lost workers are told by what becomes of their frames.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
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
        try:
            yield client
        finally:
            with suppress(OSError):
                client.run(_close_places)


def _threads(client: Client) -> int:
    of_worker: Any = client.nthreads()
    return max(sum(of_worker.values()), 1)


def _answer(future: Future, task: Task, address: str) -> dict[str, Any]:
    """The reply to one task.

    Raises:
        RfgsError: It failed, or the cluster gave it up.
    """
    if future.status == "cancelled":
        raise RfgsError(
            f"--scheduler {address}: the scheduler is gone; finished frames are kept, run the "
            "same command to continue"
        )
    if future.status != "finished":
        error: Any = future.exception()
        raise RfgsError(
            f"tracing failed on the cluster: {task}: {type(error).__name__}: {error}"
        ) from error
    reply = future.result()
    if "error" in reply:
        raise failure(task, reply, reply.get("log", ""))
    return reply


def _packed(bundle: Path) -> bytes:
    """The scene without its frames, as an archive."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz", compresslevel=1) as archive:
        for path in sorted(bundle.rglob("*")):
            name = path.relative_to(bundle)
            if path.is_file() and name.parts[0] != "frames":
                archive.add(path, name.as_posix())
    return buffer.getvalue()


def _frame_file(bundle: Path, frame: int) -> Path:
    return bundle / "frames" / f"{frame:06d}.npz"


class _Place:
    """Where one thread of a Dask worker keeps a scene and traces it."""

    def __init__(self, key: str, scene: bytes, job: dict[str, Any], limits: Limits) -> None:
        from distributed import get_worker

        self.key = key
        self._folder = tempfile.TemporaryDirectory(prefix="rfgs-", dir=get_worker().local_directory)
        self.path = Path(self._folder.name)
        self.bundle = self.path / "bundle"
        with tarfile.open(fileobj=io.BytesIO(scene), mode="r:gz") as archive:
            archive.extractall(self.bundle, filter="data")
        (self.bundle / "frames").mkdir()
        self.log = self.path / "log"
        self.lane = Lane({**job, "bundle": str(self.bundle)}, self.log, limits)

    def close(self) -> None:
        """Ends the tracing process and removes the scene."""
        self.lane.end()
        self._folder.cleanup()


def _close_places() -> None:
    """Ends what a run has left on a Dask worker: its threads keep scenes for the next frame."""
    while _PLACES:
        _PLACES.popitem()[1].close()


def _trace_here(
    key: str,
    scene: bytes,
    job: dict[str, Any],
    moving: bytes,
    task: Task,
    limits: Limits,
    wanted: dict[str, str],
) -> dict[str, Any]:
    """Traces one frame; runs in a thread of a Dask worker."""
    for name, version in versions().items():
        if version != wanted[name]:
            return {
                "error": f"a worker of the cluster has {name} {version}, this machine "
                f"{wanted[name]}; bytes would depend on who traced, so install the same everywhere"
            }
    place = _PLACES.get(threading.get_ident())
    if place is None or place.key != key:
        if place is not None:
            place.close()
        place = _PLACES[threading.get_ident()] = _Place(key, scene, job, limits)
    if task.frame is not None:
        _frame_file(place.bundle, task.frame).write_bytes(moving)
    file = place.path / "value.npy"
    reply = place.lane.trace({**task.request, "file": str(file)})
    if "error" in reply:
        return {**reply, "log": f"{place.log} on {socket.gethostname()}"}
    table = file.with_suffix(".npz")
    paths = table.read_bytes() if job["paths"] else b""
    return {**reply, "value": np.load(file, allow_pickle=False), "paths": paths}
