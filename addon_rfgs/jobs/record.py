# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left of a job when Blender is gone: a file beside its log, and a list of such files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import AddonError
from ..files import refuse_pipe, write_json
from ..json_file import Fields, read_json
from ..seals import check_seal, write_sealed_json
from .plans import Plan, plan_of_json, plan_to_json

SCHEMA = "rfgs-job-1"
#: Largest file that is read [bytes].
_LARGEST = 100_000
_FORM = Fields({"schema": str, "pid": int, "born": str, "kind": str, "settings": {str: object}})
_REMEDY = "delete it and start the job anew"
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
        write_sealed_json(file, row)
    except OSError as error:
        raise AddonError(f"{file}: cannot be written: {error.strerror}") from error


def read_record(file: Path) -> Record:
    """A job that was noted.

    Raises:
        AddonError: There is none, or it is damaged.
    """
    row = read_json(file, _FORM, _REMEDY, _LARGEST)
    check_seal(file, _REMEDY)
    pid, born = row["pid"], row["born"]
    if row["schema"] != SCHEMA or not 0 <= pid < 1 << 31:
        raise AddonError(f"{file}: no job of this add-on; {_REMEDY}")
    plan = plan_of_json(row, file)
    if record_file(plan).resolve() != file.resolve():
        raise AddonError(
            f"{file}: tells of {plan.out!r:.200}; that folder was moved, start the job anew"
        )
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
        rows = read_json(listed, [str], "delete it", _LARGEST)
    except AddonError:
        return []
    files = [Path(row) for row in rows[:_MOST] if "\0" not in row]
    return [file for file in files if file.is_absolute() and file.is_file()]


def _refuse_link(file: Path) -> None:
    """Refuses a log folder, record or log that is a link: it would be written where that leads.

    Raises:
        AddonError: It is one, or a pipe, which keeps its writer waiting.
    """
    for place in (file.parent, file, file.with_suffix(".log")):
        if place.is_symlink():
            raise AddonError(f"{place}: a symbolic link; replace it by a folder or file of its own")
    for place in (file, file.with_suffix(".log")):
        refuse_pipe(place)
