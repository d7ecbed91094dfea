# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left of a job when Blender is gone: a file beside its log, and a list of such files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import AddonError
from ..files import write_json
from .plans import Plan, plan_of_json, plan_to_json

SCHEMA = "rfgs-job-1"
#: Largest file that is read [bytes].
_LARGEST = 100_000
#: How many unfinished jobs are remembered.
_MOST = 50


@dataclass(frozen=True)
class Record:
    """A job as it was last seen."""

    plan: Plan
    pid: int
    """Number of its process; 0 if it has not begun."""
    born: str
    """When that began, see `process.birth`."""


def log_file(plan: Plan) -> Path:
    """Where the program of a job writes what it says."""
    return Path(plan.out) / "log" / f"job_{plan.kind}.log"


def record_file(plan: Plan) -> Path:
    """Where a job is noted."""
    return Path(plan.out) / "log" / f"job_{plan.kind}.json"


def write_record(record: Record) -> None:
    """Notes a job in its output folder.

    Raises:
        AddonError: Nothing can be written there.
    """
    file = record_file(record.plan)
    _refuse_link(file)
    row = {"schema": SCHEMA, "pid": record.pid, "born": record.born, **plan_to_json(record.plan)}
    try:
        write_json(file, row)
    except OSError as error:
        raise AddonError(f"{file}: cannot be written: {error.strerror}") from error


def read_record(file: Path) -> Record:
    """A job that was noted.

    Raises:
        AddonError: There is none, or it is damaged.
    """
    row = _read(file)
    if not isinstance(row, dict) or row.get("schema") != SCHEMA:
        raise AddonError(f"{file}: no job of this add-on; delete it and start the job anew")
    pid, born = row.get("pid"), row.get("born")
    if type(pid) is not int or type(born) is not str or not 0 <= pid < 1 << 31:
        raise AddonError(f"{file}: damaged; delete it and start the job anew")
    plan = plan_of_json(row, file)
    if record_file(plan).resolve() != file.resolve():
        raise AddonError(f"{file}: tells of {plan.out}; that folder was moved, start the job anew")
    return Record(plan, pid, born)


def remember(files: list[Path], listed: Path) -> None:
    """Keeps the list of unfinished jobs; without any, no file."""
    if files:
        write_json(listed, [str(file) for file in files[-_MOST:]])
    else:
        listed.unlink(missing_ok=True)


def remembered(listed: Path) -> list[Path]:
    """The records of the list that are still there."""
    if not listed.is_file():
        return []
    try:
        rows = _read(listed)
    except AddonError:
        return []
    rows = rows if isinstance(rows, list) else []
    files = [Path(row) for row in rows[:_MOST] if isinstance(row, str) and "\0" not in row]
    return [file for file in files if file.is_absolute() and file.is_file()]


def _refuse_link(file: Path) -> None:
    """Refuses a log folder, record or log that is a link: it would be written where that leads.

    Raises:
        AddonError: It is one.
    """
    for place in (file.parent, file, file.with_suffix(".log")):
        if place.is_symlink():
            raise AddonError(f"{place}: a symbolic link; replace it by a folder or file of its own")


def _read(file: Path) -> Any:
    try:
        if file.stat().st_size > _LARGEST:
            raise AddonError(f"{file}: larger than a job's record; delete it")
        return json.loads(file.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise AddonError(f"{file}: cannot be read; start the job anew") from error
