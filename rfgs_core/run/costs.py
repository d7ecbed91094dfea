# SPDX-License-Identifier: Apache-2.0
"""What the stages of a training cost, so that the time left is right from the first frame on."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from rfgs_core.cache import cache_folder
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json
from rfgs_core.records import read_record
from rfgs_core.run.folder import Run


@dataclass(frozen=True)
class Costs:
    """Time of one frame's stages [s]."""

    find_s: float
    """Finding bodies and drawing Gaussians."""
    solve_s: float
    """Solving reflectivities."""
    step_s: float
    """One step of the refinement."""

    def frame_s(self, iterations: int) -> float:
        """Time of a frame with so many steps."""
        return self.find_s + self.solve_s + iterations * self.step_s


#: Where nothing was measured yet: one access point room on one core; only the ratios count.
USUAL = Costs(find_s=7.0, solve_s=3.0, step_s=0.07)


def recalled(run: Run) -> Costs | None:
    """What trainings like this one have cost on this machine, None if there was none."""
    # A note that cannot be read or written is no reason not to train.
    with suppress(RfgsError, OSError):
        file = _file(run)
        return read_record(file, Costs, "delete it") if file.is_file() else None
    return None


def price_line(run: Run) -> str:
    """One line before a training begins: how much, how long, and what would be less.

    Args:
        run: The run; its settings say how many steps and Gaussians.
    """
    settings, known = run.config.settings, recalled(run)
    frames = sum(not run.ply_path(frame).is_file() for frame in run.frames)
    disk_mb = frames * settings.num_gaussians * BYTES_PER_GAUSSIAN / 1e6
    what = f"{frames} frames to fit, {settings.iterations} steps each, about {disk_mb:.0f} MB"
    if known is None:
        return f"{what}; how long is known after the first; fewer --frames make it less"
    seconds = frames * known.frame_s(settings.iterations)
    took = f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.0f} min"
    return f"{what}; about {took}, as measured here before; fewer --frames or --iterations are less"


#: PLY, features and checkpoint of a Gaussian of a frame [B].
BYTES_PER_GAUSSIAN = 420.0

_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"


class CostBar:
    """A progress bar that counts what stages cost, not how many they are."""

    def __init__(self, run: Run, iterations: int) -> None:
        """Begins with what is remembered, or what is usual."""
        self._run, self._iterations = run, iterations
        self._costs = recalled(run) or USUAL
        self._left = len(run.frames)
        self._begin = self._found = self._solved = 0.0
        self._steps = 0
        # It counts expected seconds, which nobody wants to read; who sets a format has their own.
        form = os.environ.get("TQDM_BAR_FORMAT", _FORMAT)
        self._bar = tqdm(total=self._total(), desc=f"train {run.config.radio}", bar_format=form)

    def _total(self) -> float:
        return round(self._left * self._costs.frame_s(self._iterations), 2)

    def _advance(self, cost_s: float) -> None:
        # Rounding may carry the sum past the total, which tqdm complains of.
        self._bar.update(min(cost_s, max(self._bar.total - self._bar.n, 0.0)))

    def skip(self) -> None:
        """A frame was fitted before."""
        self._left -= 1
        self._bar.total = self._bar.n + self._total()
        self._bar.refresh()

    def begin(self, said: str) -> None:
        """A frame is begun: bodies are found."""
        self._begin, self._steps = time.perf_counter(), 0
        self._bar.set_postfix_str(said)

    def found(self, said: str) -> None:
        """Bodies are found: reflectivities are solved."""
        self._found = time.perf_counter()
        self._advance(self._costs.find_s)
        self._bar.set_postfix_str(said)

    def solved(self) -> None:
        """Reflectivities are solved: the refinement begins."""
        self._solved = time.perf_counter()
        self._advance(self._costs.solve_s)

    def step(self, said: str) -> None:
        """A step of the refinement is done."""
        self._steps += 1
        self._advance(self._costs.step_s)
        self._bar.set_postfix_str(said)

    def finish_frame(self) -> None:
        """A frame is fitted: what it took is what the others are taken to cost."""
        now = time.perf_counter()
        self._left -= 1
        # A frame that was continued has skipped what would tell.
        if self._steps == self._iterations and self._begin < self._found < self._solved:
            self._costs = Costs(
                self._found - self._begin,
                self._solved - self._found,
                (now - self._solved) / max(self._steps, 1),
            )
            with suppress(RfgsError, OSError):
                write_json(_file(self._run), asdict(self._costs))
        self._bar.total = self._bar.n + self._total()
        self._bar.refresh()

    def close(self) -> None:
        """Ends the bar."""
        self._bar.close()


@contextmanager
def cost_bar(run: Run, iterations: int) -> Iterator[CostBar]:
    """A bar for as long as the block runs."""
    sys.stderr.write(f"{price_line(run)}\n")
    bar = CostBar(run, iterations)
    try:
        yield bar
    finally:
        bar.close()


def _file(run: Run) -> Path:
    """Where costs of trainings like this one lie; frames, seed and steps do not count."""
    settings: dict[str, Any] = asdict(run.config.settings)
    for name in ("seed", "iterations"):
        settings.pop(name)
    machine = [platform.node(), platform.machine(), os.cpu_count()]
    shape = run.sequence.layout(run.config.radio).measured.shape
    what = [settings, run.config.radio, shape, machine]
    key = hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()
    return cache_folder("costs") / f"{key[:32]}.json"
