# SPDX-License-Identifier: Apache-2.0
"""Parts of a study, a table or many trainings: made one after another here, or by workers.

Workers share no disk with this process: a part's dataset goes there as an archive, what was made
of it comes back as one, and only this process writes the folder of all.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.provenance import versions
from rfgs_core.links import refuse_link
from rfgs_core.schedule.answers import Answer, answer_of, begin, refuse_other_versions
from rfgs_core.schedule.archive import packed, unpack
from rfgs_core.schedule.spread import Spread
from rfgs_core.schedule.workers import Workers

if TYPE_CHECKING:
    from distributed import Future

#: Folders within the study's: what workers of this machine keep meanwhile, and their logs.
_SCRATCH, _LOG = Path(".work"), Path("log")


class Part(Protocol):
    """A piece of work by itself; its `str` names it."""

    @property
    def dataset(self) -> Path:
        """Folder of its dataset within the study's; of one that lies elsewhere, at a worker."""
        ...

    @property
    def made(self) -> tuple[Path, ...]:
        """Files and folders that it makes there; the last one is what says that it is done."""
        ...

    def make(self, out: Path) -> None:
        """Makes them.

        Raises:
            RfgsError: It cannot be made.
        """
        ...


P = TypeVar("P", bound=Part)


@dataclass(frozen=True)
class Parcel:
    """What a worker gets of a part."""

    part: Part
    """As it is made there."""
    archive: Callable[[], bytes]
    """Packs what will be the folder of its dataset; asked once for parts of the same dataset."""


def datasets_missing(
    wanted: Sequence[P], out: Path, generate: Callable[[P], None], tell: Callable[[str], None]
) -> dict[Path, str]:
    """Generates datasets that are not there, each once.

    Args:
        wanted: Parts that ask for them.
        out: Folder of the study or table.
        generate: Generates the dataset of a part.
        tell: Is told what is being generated.

    Returns:
        Dataset → why it could not be made.
    """
    missing: dict[Path, str] = {}
    for one in wanted:
        if one.dataset in missing or (out / one.dataset / "dataset.json").exists():
            continue
        tell(str(one.dataset))
        try:
            generate(one)
        except RfgsError as error:
            missing[one.dataset] = str(error)
    return missing


def outcomes(
    parts: Sequence[P],
    out: Path,
    spread: Spread,
    finished: Callable[[P], bool],
    generate: Callable[[P], None] | None,
    tell: Callable[[str], None],
    send: Callable[[P], Parcel] | None = None,
) -> Iterator[tuple[P, str]]:
    """Parts as they are there; first what is finished, then those without a dataset.

    Args:
        parts: All of them.
        out: Folder of the study or table.
        spread: Who makes them.
        finished: Whether a part was made before; an `RfgsError` says why it can be made in no way.
        generate: Generates the dataset of a part; None where all are there.
        tell: Is told what is under way.
        send: As of `made`.

    Yields:
        Each part, and why it is not there; empty if it is.

    Raises:
        RfgsError: There are no workers, or they are gone.
    """
    left: list[P] = []
    for part in parts:
        try:
            there = finished(part)
        except RfgsError as error:
            yield part, str(error)
            continue
        if there:
            yield part, ""
        else:
            left.append(part)
    missing = datasets_missing(left, out, generate, tell) if generate else {}
    yield from ((part, missing[part.dataset]) for part in left if part.dataset in missing)
    ready = [one for one in left if one.dataset not in missing]
    for part, failure in made(ready, out, spread, send):
        tell(str(part))
        yield part, failure


def made(
    parts: Sequence[P],
    out: Path,
    spread: Spread,
    send: Callable[[P], Parcel] | None = None,
) -> Iterator[tuple[P, str]]:
    """Makes parts, whose datasets are there.

    Args:
        parts: What is missing.
        out: Folder of the study or table.
        spread: Who makes them: one after another here, or workers.
        send: What a worker gets of a part; left out: the part, and its dataset within the study.

    Yields:
        Each part when it is made or has failed, and why it failed; empty if it did not. Of
        workers they come in any order.

    Raises:
        RfgsError: There are no workers, or they are gone.
    """
    if not spread.scheduler and (spread.workers == 1 or len(parts) < 2):
        for part in parts:
            try:
                part.make(out)
                yield part, ""
            except RfgsError as error:
                yield part, str(error)
        return
    refuse_link(out / _SCRATCH)
    try:
        with spread.ready(len(parts), out / _SCRATCH, out / _LOG, _leave) as workers:
            yield from _by_workers(workers, parts, out, send)
    finally:
        if not spread.scheduler:
            shutil.rmtree(out / _SCRATCH, ignore_errors=True)


def _by_workers(
    workers: Workers, parts: Sequence[P], out: Path, send: Callable[[P], Parcel] | None
) -> Iterator[tuple[P, str]]:
    client, datasets, left = workers.client, {}, Counter(part.dataset for part in parts)
    log = str((out / _LOG).absolute()) if workers.ours else ""

    def submit(part: P) -> Future:
        parcel = send(part) if send else Parcel(part, lambda: packed(out / part.dataset))
        if part.dataset not in datasets:
            # A task of its own, so that Dask makes it again where the worker that held it died.
            datasets[part.dataset] = client.submit(bytes, parcel.archive(), pure=False)
        dataset = datasets[part.dataset]
        return client.submit(_make, parcel.part, dataset, versions(), log, pure=False)

    for part, answer in workers.answers(parts, submit, doing="making"):
        left[part.dataset] -= 1
        if not left[part.dataset]:
            # Of many datasets, workers would come to hold all.
            del datasets[part.dataset]
        archive, failure = answer.value
        if not failure:
            _place(archive, part, out)
        elif workers.ours:
            failure += f" (the log is in {out / _LOG})"
        yield part, failure


def _place(archive: bytes, part: Part, out: Path) -> None:
    """Puts what a worker made where it belongs, instead of what an earlier run began."""
    with tempfile.TemporaryDirectory(prefix=".tmp-", dir=out) as folder:
        unpack(archive, Path(folder))
        for number, name in enumerate(part.made):
            place = out / name
            refuse_link(place)
            place.parent.mkdir(parents=True, exist_ok=True)
            if place.is_dir():
                # Not deleted before the new one is there.
                os.replace(place, Path(folder) / f".old-{number}")
            os.replace(Path(folder) / name, place)


def _make(
    part: Part, dataset: bytes, wanted: dict[str, str], log: str
) -> Answer[tuple[bytes, str]]:
    """Makes a part inside a worker: the archive of what was made, or why it failed.

    Args:
        part: The part.
        dataset: Archive of its dataset.
        wanted: Versions of the packages of the process that asks.
        log: Folder for what is printed; empty leaves it where it goes.

    Raises:
        RfgsError: This worker has other packages.
    """
    import numba
    import torch
    from distributed import get_worker

    worker: Any = get_worker()
    refuse_other_versions(versions(), wanted)
    if log:
        begin(Path(log) / f"worker{worker.name}.log")
    numba.set_num_threads(1)
    torch.set_num_threads(1)
    out, archive, failure = _folder_with(part, dataset, worker.local_directory), b"", ""
    try:
        part.make(out)
        archive = packed(out, without=part.dataset.parts[0])
    except RfgsError as error:
        # The worker's own folder is gone when this is read; below it names are the study's.
        failure = str(error).replace(f"{out}{os.sep}", "")
    finally:
        for rest in out.iterdir():
            if rest.name != part.dataset.parts[0]:
                shutil.rmtree(rest)
    return answer_of(worker, (archive, failure), {}, done=0)


#: Digest of the dataset that this worker keeps, and the folder that it lies in: what parts of one
#: dataset share is computed once.
_kept: tuple[str, tempfile.TemporaryDirectory[str]] | None = None


def _folder_with(part: Part, dataset: bytes, scratch: str) -> Path:
    """A folder that holds a part's dataset and nothing else."""
    global _kept
    digest = hashlib.sha256(dataset).hexdigest()
    if _kept is None or _kept[0] != digest:
        _leave()
        folder = tempfile.TemporaryDirectory(prefix="rfgs-", dir=scratch)
        _kept = (digest, folder)
        unpack(dataset, Path(folder.name) / part.dataset)
    return Path(_kept[1].name)


def _leave() -> None:
    """Drops what this worker keeps."""
    global _kept
    if _kept is not None:
        _kept[1].cleanup()
        _kept = None
