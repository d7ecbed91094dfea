# SPDX-License-Identifier: Apache-2.0
"""What a run was asked for, as `config.json` keeps it."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.records import record
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.settings import TrainConfig

#: Schema of `config.json`.
SCHEMA = "rfgs-run/1"
#: What the settings of a training are kept in, within a run.
CONFIG_FILE = "config.json"
#: What decodes reflectivities from features.
HEAD_FILE = "radio_head.npz"
#: What helps where a file of a run cannot be read.
REMEDY = "delete what is damaged and run the same `rfgs train` again"
#: Not a property of the result: a run may go on elsewhere.
_NOT_KEPT = ("device",)


@dataclass(frozen=True)
class RunConfig:
    """Data and settings of a run."""

    dataset: str
    """Path of the dataset, relative to the run."""
    dataset_fingerprint: str
    """Digest of the dataset that it was trained on."""
    sequence: str
    """Which sequence."""
    radio: str
    """Which radio."""
    frames: list[int]
    """Frames the run is trained on."""
    settings: TrainConfig
    """How they are fitted."""
    train_s: float = 0.0
    """Time that the training has taken so far [s]."""

    @property
    def entries(self) -> dict[str, Any]:
        """What the file holds, all on one level."""
        settings = {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(self.settings).items()
            if name not in _NOT_KEPT
        }
        own = {name: getattr(self, name) for name in _OWN}
        return {"schema": SCHEMA, **own, **settings, "train_s": self.train_s}

    def differing(self, other: RunConfig) -> list[str]:
        """Names of the entries in which two runs differ; how long they took does not count."""
        mine, theirs = self.entries, other.entries
        return [name for name in mine if name != "train_s" and mine[name] != theirs[name]]

    def write(self, run: Path) -> None:
        """Writes the file of a run."""
        write_sealed_json(run / CONFIG_FILE, self.entries)

    @staticmethod
    def read(run: Path) -> RunConfig:
        """Reads the file of a run.

        Raises:
            RfgsError: There is no run.
            RfgsFormatError: It is of another version, or damaged.
        """
        path = run / CONFIG_FILE
        try:
            stored = read_sealed_json(path, _REMEDY)
        except RfgsFormatError:
            raise
        except RfgsError as error:
            raise RfgsError(_why_no_run(run)) from error
        if stored.get("schema") != SCHEMA:
            raise RfgsFormatError(
                f"{path}: expected schema {SCHEMA}, found {stored.get('schema')}; "
                "use the version of rfgs that made it, or train again"
            )
        stored = {**_UNSAID, **stored}
        _need_entries(path, stored)
        own = {name: stored[name] for name in (*_OWN, "train_s") if name in stored}
        try:
            config: RunConfig = record(path, {**own, "settings": stored}, RunConfig, _REMEDY)
        except RfgsFormatError as error:
            # In the file, everything stands on one level.
            raise RfgsFormatError(str(error).replace(": settings.", ": ", 1)) from error
        except RfgsError as error:
            raise RfgsFormatError(f"{path}: {error}; {_REMEDY}") from error
        if not config.frames or sorted(set(config.frames)) != config.frames:
            raise RfgsFormatError(
                f"{path}: frames: expected a list of ascending numbers, found {config.frames[:9]}; "
                f"{_REMEDY}"
            )
        return config


def runs_in(folder: Path) -> list[Path]:
    """Runs that lie side by side in a folder, as `rfgs train` leaves several; by name."""
    return sorted(file.parent for file in folder.glob(f"*/{CONFIG_FILE}"))


def _why_no_run(folder: Path) -> str:
    """Why a folder is not a run, and what to name instead."""
    held = [str(run) for run in runs_in(folder)]
    if not held:
        return f"{folder} is not a run: it has no {CONFIG_FILE}; `rfgs train` makes one"
    more = f" and {len(held) - _NAMED} more" if len(held) > _NAMED else ""
    return f"{folder} is not a run, but holds some; name one: {', '.join(held[:_NAMED])}{more}"


def relative_dataset(run: Path, dataset: Path) -> str:
    """Path of the dataset as stored in a run: relative, so that both can move together."""
    return Path(os.path.relpath(dataset.resolve(), run.resolve())).as_posix()


#: What held of runs without a word of it: they started from the prior, and saw no wall.
_UNSAID = {"start": "prior", "excess_m": 0.0}
_REMEDY = "train again"
#: Runs that are named where one of a folder's is expected.
_NAMED = 6
_OWN = tuple(field.name for field in fields(RunConfig) if field.name not in ("settings", "train_s"))
_SETTINGS = tuple(field.name for field in fields(TrainConfig) if field.name not in _NOT_KEPT)

_KNOWN, _BESIDE = frozenset((*_OWN, *_SETTINGS)), frozenset(("schema", "train_s"))


def _need_entries(path: Path, stored: dict[str, Any]) -> None:
    """Refuses entries that are missing or unknown.

    Raises:
        RfgsFormatError: There are such; they are named.
    """
    entries = stored.keys() - _BESIDE
    if entries != _KNOWN:
        parts = (("missing", sorted(_KNOWN - entries)), ("unknown", sorted(entries - _KNOWN)))
        found = "; ".join(f"{', '.join(names)} {word}" for word, names in parts if names)
        raise RfgsFormatError(
            f"{path}: expected the entries of this version of rfgs, found {found}; use the "
            "version that made the run, or train again"
        )
