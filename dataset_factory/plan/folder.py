# SPDX-License-Identifier: Apache-2.0
"""The folder of a dataset that is being made: whose it is, and what a killed run left there."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from dataset_factory.plan.contents import refuse_other_plan
from dataset_factory.plan.job import Job
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.errors import RfgsError
from rfgs_core.links import described, strange_entries
from rfgs_core.locks import alone_in


def open_folder(job: Job) -> bool:
    """Whether something is left to make; nothing is written.

    Raises:
        RfgsError: The folder holds something else, or a dataset with other settings.
    """
    file = job.out / "dataset.json"
    for place in (file, job.work, job.out / "log"):
        odd = place if place.is_symlink() else _odd_within(place)
        if odd is not None:
            raise RfgsError(f"{odd}: {described(odd)}; expected a file or folder of the dataset")
    if file.is_file():
        stored = read_dataset_info(file)
        made_with = {} if stored.manifest_sha256 else stored.versions
        refuse_other_plan(job.out, job.plan, stored.config, made_with)
        if stored.manifest_sha256:
            return False
    elif job.out.is_dir() and any(
        entry.name not in (".work", "log") and not entry.name.startswith(".tmp-")
        for entry in job.out.iterdir()
    ):
        raise RfgsError(f"{job.out}: not empty and no dataset; choose another --out")
    elif job.out.exists() and not job.out.is_dir():
        raise RfgsError(f"{job.out}: a file of that name exists; choose another --out")
    return True


def _odd_within(place: Path) -> Path | None:
    """The first link, pipe or the like below a folder; None without any."""
    return next(strange_entries(place), None) if place.is_dir() else None


@contextmanager
def locked(job: Job) -> Iterator[None]:
    """Keeps other runs out of the folder.

    Where the block refuses the scene before it claims the folder, nothing is left of it.

    Raises:
        RfgsError: One is at work there.
    """
    made = [place for place in (job.out, *job.out.absolute().parents) if not place.exists()]
    job.work.mkdir(parents=True, exist_ok=True)
    lock = job.work / "lock"
    lock.touch()
    with alone_in(lock, job.out, "rfgs-factory"):
        try:
            yield
        except RfgsError:
            if not (job.out / "dataset.json").exists():
                _take_back(job, made)
            raise


@contextmanager
def claim_taken_back(job: Job, begun: bool) -> Iterator[None]:
    """Where the block refuses a dataset that this run has just begun, the folder is free again.

    Args:
        job: The run, whose folder is `locked`.
        begun: Whether an earlier run began it, whose work stays.
    """
    try:
        yield
    except RfgsError:
        if not begun:
            shutil.rmtree(job.files.root, ignore_errors=True)
            (job.out / "dataset.json").unlink()
        raise


def _take_back(job: Job, made: list[Path]) -> None:
    """Removes what a run wrote, and the folders that it made, the innermost first."""
    shutil.rmtree(job.work, ignore_errors=True)
    (job.out / "log" / "generate.json").unlink(missing_ok=True)
    for place in (job.out / "log", *made):
        # Where somebody else keeps something it stays.
        with suppress(OSError):
            place.rmdir()
