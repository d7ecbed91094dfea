# SPDX-License-Identifier: Apache-2.0
"""What a run was asked for, as `config.json` keeps it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json, write_json
from rfgs_core.settings import TrainConfig

#: Schema of `config.json`.
SCHEMA = "rfgs-run/1"
#: What the settings of a training are kept in, within a run.
CONFIG_FILE = "config.json"
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
        write_json(run / CONFIG_FILE, self.entries)

    @staticmethod
    def read(run: Path) -> RunConfig:
        """Reads the file of a run.

        Raises:
            RfgsError: There is no run.
            RfgsFormatError: It is of another version, or damaged.
        """
        path = run / CONFIG_FILE
        if not path.exists():
            raise RfgsError(f"{run} is not a run: it has no {CONFIG_FILE}; `rfgs train` makes one")
        stored = read_json(path)
        if not isinstance(stored, dict) or stored.get("schema") != SCHEMA:
            found = stored.get("schema") if isinstance(stored, dict) else type(stored).__name__
            raise RfgsFormatError(
                f"{path}: expected schema {SCHEMA}, found {found}; "
                "use the version of rfgs that made it, or train again"
            )
        _need_entries(path, stored)
        own = {name: stored[name] for name in (*_OWN, "train_s") if name in stored}
        settings = {name: stored[name] for name in _SETTINGS}
        without = tuple(settings.pop("without"))
        return RunConfig(**own, settings=TrainConfig(**settings, without=without))


_OWN = tuple(field.name for field in fields(RunConfig) if field.name not in ("settings", "train_s"))
_SETTINGS = tuple(field.name for field in fields(TrainConfig) if field.name not in _NOT_KEPT)
_TYPES: dict[type, tuple[tuple[type, ...], str]] = {
    str: ((str,), "a text"),
    int: ((int,), "a whole number"),
    float: ((int, float), "a number"),
}


def _need_entries(path: Path, stored: dict[str, Any]) -> None:
    """Refuses entries that are missing, unknown or of another type.

    Raises:
        RfgsFormatError: There are such; they are named.
    """
    known = {*_OWN, *_SETTINGS}
    missing, unknown = known - stored.keys(), stored.keys() - known - {"schema", "train_s"}
    if missing or unknown:
        parts = (("missing", sorted(missing)), ("unknown", sorted(unknown)))
        found = "; ".join(f"{', '.join(names)} {word}" for word, names in parts if names)
        raise RfgsFormatError(
            f"{path}: expected the entries of this version of rfgs, found {found}; use the "
            "version that made the run, or train again"
        )
    hints = {**get_type_hints(RunConfig), **get_type_hints(TrainConfig)}
    for name, value in stored.items():
        expected = _complaint(name, value, hints.get(name))
        if expected is not None:
            raise RfgsFormatError(
                f"{path}: {name}: expected {expected}, found {value!r}; train again"
            )


def _complaint(name: str, value: object, hint: Any) -> str | None:
    """What an entry should have been; None where it is."""
    if name == "frames":
        fine = isinstance(value, list) and value and all(type(number) is int for number in value)
        return None if fine else "a list of numbers"
    if get_origin(hint) is Literal:
        return None if value in get_args(hint) else f"one of {', '.join(get_args(hint))}"
    if get_origin(hint) is tuple:
        return None if isinstance(value, list) else "a list"
    kinds, words = _TYPES.get(hint, ((object,), ""))
    return None if type(value) in kinds or object in kinds else words
