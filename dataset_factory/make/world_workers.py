# SPDX-License-Identifier: Apache-2.0
"""Random worlds made by Dask's workers: datasets come back as archives, only the command writes."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dataset_factory.make.world_files import name_of, write_world
from dataset_factory.plan.contents import versions
from rfgs_core.schedule.answers import Answer, answer_of, begin, refuse_other_versions
from rfgs_core.schedule.archive import packed
from rfgs_core.schedule.workers import Workers
from rfgs_core.worlds.settings_file import WorldsFile
from rfgs_core.worlds.world import random_world, sounded

if TYPE_CHECKING:
    from distributed import Future


class _Task(NamedTuple):
    """A world that is missing."""

    index: int

    def __str__(self) -> str:
        return name_of(self.index)


def archives_of(
    workers: Workers, shared: WorldsFile, indices: list[int], log: Path
) -> Iterator[tuple[int, bytes]]:
    """Numbers and archives of worlds, in the order in which they are made.

    Args:
        workers: Who makes them.
        shared: What the worlds have in common.
        indices: Their numbers.
        log: Folder of logs of this machine's workers.

    Raises:
        RfgsError: A world cannot be made, or the workers are gone.
    """
    here = str(log.absolute()) if workers.ours else ""

    def submit(task: _Task) -> Future:
        return workers.client.submit(_world, shared, versions(), here, task.index, pure=False)

    tasks = [_Task(index) for index in indices]
    for task, answer in workers.answers(tasks, submit, doing="tracing"):
        yield task.index, answer.value


def _world(shared: WorldsFile, wanted: dict[str, str], log: str, index: int) -> Answer[bytes]:
    """Makes one world inside a worker.

    Raises:
        RfgsError: There is no such world, or other packages would make it than elsewhere.
    """
    import numba
    from distributed import get_worker

    worker: Any = get_worker()
    refuse_other_versions(versions(), wanted)
    if log:
        begin(Path(log) / f"worker{worker.name}.log")
    numba.set_num_threads(1)
    heard = sounded(
        random_world(shared.radio, shared.settings, shared.seed, index),
        shared.settings,
        shared.seed,
    )
    with tempfile.TemporaryDirectory(prefix="rfgs-", dir=worker.local_directory) as folder:
        write_world(Path(folder), heard, shared.settings, shared.seed)
        archive = packed(Path(folder))
    return answer_of(worker, archive, {}, done=0)
