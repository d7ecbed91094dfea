# SPDX-License-Identifier: Apache-2.0
"""What stages of work took on this machine before, and so what they will take.

Every command that lets people wait notes how fast its stages went, in the user's cache. Before it
begins it asks here: a stage like one that ran before takes what that took; any other takes what is
usual (measured once, on two cores), times what this machine took of the usual so far.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from rfgs_core.cache import cache_folder
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json
from rfgs_core.records import read_record

T = TypeVar("T")

#: Newest notes that tell how this machine compares with what is usual.
_NOTES = 50


@dataclass(frozen=True)
class Speed:
    """How fast a stage goes: a start that is paid once, then equal steps."""

    start_s: float
    """Time before work begins: loading programs, scenes and kernels [s]."""
    step_s: float
    """Time from one finished step to the next, all processes together [s]."""

    def seconds(self, steps: float) -> float:
        """Time that a stage of so many steps takes [s]."""
        return self.start_s + self.step_s * steps

    def times(self, factor: float) -> Speed:
        """The speed of a machine that takes so many times as long."""
        return Speed(self.start_s * factor, self.step_s * factor)


@dataclass
class Clock:
    """Notes when a stage begins and when its steps end."""

    at_once: int = 1
    """Steps that are worked on at the same time; the first of each process tell the start only."""
    first: int = 0
    """Steps before those that tell of the start only too, as they are unlike the others."""
    now: Callable[[], float] = time.perf_counter
    """The time [s]."""
    began_s: float | None = None
    """When the stage began [s]; None is now."""
    ends_s: list[float] = field(default_factory=list)
    """When its steps ended [s]."""

    def __post_init__(self) -> None:
        if self.began_s is None:
            self.began_s = self.now()

    def step(self) -> None:
        """A step has ended."""
        self.ends_s.append(self.now())

    def speed(self) -> Speed | None:
        """The speed, None where too few steps have ended to know."""
        assert self.began_s is not None
        start = self.at_once + self.first
        counted = len(self.ends_s) - start
        if counted < self.at_once:
            return None
        step_s = (self.ends_s[-1] - self.ends_s[start - 1]) / counted
        start_s = max(self.ends_s[-1] - self.began_s - step_s * len(self.ends_s), 0.0)
        return Speed(round(start_s, 3), round(step_s, 4))


@dataclass(frozen=True)
class Stage:
    """A stage that is to come."""

    name: str
    """In words, such as `trace wifi`."""
    kind: str
    """What this machine may be slow or fast at, such as `trace-sionna`; part of a file name."""
    what: Any
    """Everything that decides how long a step takes, as JSON holds it."""
    steps: int
    """Steps to come."""
    usual: Speed
    """Its speed on two cores that were measured."""
    starts: int = 1
    """How often the start is paid."""


@dataclass(frozen=True)
class _Note:
    """What is kept of a stage."""

    speed: Speed
    """How fast it went."""
    of_usual: float
    """Its step beside the usual one of the same size."""


@dataclass(frozen=True)
class Forecast:
    """What stages will take."""

    seconds: dict[str, float]
    """Wall time by stage [s]."""
    measured: frozenset[str]
    """Stages all of which ran here before; those of one name count together."""
    scaled: bool
    """Whether the rest is usual speeds times what this machine took of them."""

    @property
    def total_s(self) -> float:
        """Wall time of all stages [s]."""
        return sum(self.seconds.values())

    @property
    def source(self) -> str:
        """Where the times come from, in words."""
        guessed = [name for name in self.seconds if name not in self.measured]
        if not guessed:
            return "as measured here before"
        usual = "usual speeds of two cores" + (" scaled to this machine" if self.scaled else "")
        rest = f"{', '.join(guessed)} " if self.measured else ""
        return f"{rest}estimated from {usual}; becomes exact after the first frames"


def forecast(stages: Iterable[Stage]) -> Forecast:
    """What stages will take, from what stages like them took here, else from what is usual."""
    seconds, guessed, scaled = {}, set(), False
    for stage in stages:
        if (speed := past_speed(stage)) is None:
            guessed.add(stage.name)
            factor = _of_usual(stage.kind)
            scaled = scaled or factor is not None
            speed = stage.usual.times(factor or 1.0)
        total_s = speed.seconds(stage.steps) + (stage.starts - 1) * speed.start_s
        seconds[stage.name] = seconds.get(stage.name, 0.0) + (total_s if stage.steps else 0.0)
    return Forecast(seconds, frozenset(seconds) - guessed, scaled)


def past_speed(stage: Stage) -> Speed | None:
    """How fast a stage like this went here the last time, None if there was none."""
    note = recalled(stage.kind, stage.what, _Note)
    return note.speed if note else None


@contextmanager
def timed(stage: Stage) -> Iterator[Clock]:
    """Yields the clock that steps are told to, and keeps the speed; also where it is stopped."""
    clock = Clock()
    try:
        yield clock
    finally:
        if speed := clock.speed():
            note_speed(stage, speed)


def note_speed(stage: Stage, speed: Speed) -> None:
    """Keeps how fast a stage went."""
    keep(stage.kind, stage.what, _Note(speed, speed.step_s / max(stage.usual.step_s, 1e-9)))


def recalled(kind: str, what: Any, form: type[T]) -> T | None:
    """What is kept of work like this on this machine, None if there was none.

    Args:
        kind: Kind of work.
        what: Everything that decides how long it takes, as JSON holds it.
        form: Dataclass of what is kept.
    """
    # A note that cannot be read or written is no reason not to work.
    with suppress(RfgsError, OSError):
        file = _folder() / f"{kind}-{_digest([what, form.__name__])}.json"
        return read_record(file, form, "delete it") if file.is_file() else None
    return None


def keep(kind: str, what: Any, value: Any) -> None:
    """Keeps a dataclass for `recalled`; the arguments are the same."""
    with suppress(RfgsError, OSError):
        name = f"{kind}-{_digest([what, type(value).__name__])}.json"
        write_json(_folder() / name, asdict(value))


def in_words(seconds: float) -> str:
    """A time in words.

    Example:
        >>> in_words(42.0), in_words(600.0), in_words(9000.0)
        ('42 s', '10 min', '2.5 h')
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def size_in_words(size_bytes: float) -> str:
    """A size in megabytes or gigabytes."""
    return f"{size_bytes / 1e9:.1f} GB" if size_bytes >= 1e9 else f"{size_bytes / 1e6:.1f} MB"


def count_in_words(count: int, noun: str) -> str:
    """A number of things, one of them in the singular."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _of_usual(kind: str) -> float | None:
    """What this machine took of the usual time: at work of this kind, else at any; None unknown."""
    with suppress(OSError, RfgsError):
        for pattern in (f"{kind}-*.json", "*.json"):
            newest = sorted(_folder().glob(pattern), key=lambda file: -file.stat().st_mtime)
            shares = [share for file in newest[:_NOTES] if (share := _share(file)) is not None]
            if shares:
                return median(shares)
    return None


def _share(file: Path) -> float | None:
    with suppress(OSError, RfgsError):
        return read_record(file, _Note).of_usual
    return None


def _folder() -> Path:
    """Notes of this machine; a cache may lie on a disk that several share."""
    machine = [platform.node(), platform.processor(), platform.machine(), os.cpu_count()]
    folder = cache_folder("speeds") / _digest(machine)
    folder.mkdir(exist_ok=True)
    return folder


def _digest(what: Any) -> str:
    text = json.dumps(what, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
