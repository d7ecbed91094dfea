# SPDX-License-Identifier: Apache-2.0
"""What commands whose work may be spread have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

T = TypeVar("T")

if TYPE_CHECKING:
    from rfgs_core.schedule.spread import Spread


@dataclass(frozen=True)
class Spreading:
    """Who works."""

    workers: int = 1
    """Processes that train and evaluate side by side, each keeps one core busy."""
    worker_memory: float = 0.0
    """Memory of each [GB], beyond which it is stopped; 0 shares 90 % of the machine's."""
    scheduler: str = ""
    """Address of a Dask scheduler, as in tcp://node1:8786, whose workers do it instead. They need
    this version of RF-GS, no shared storage; see docs/cluster.md."""

    def checked(self) -> Spread:
        """What they ask for.

        Raises:
            RfgsError: A number is out of range, Dask is missing, or there is no such cluster.
        """
        from rfgs_core.extras import require
        from rfgs_core.schedule.spread import Spread

        spread = Spread(self.workers, self.worker_memory, self.scheduler)
        spread.check()
        if self.scheduler or self.workers > 1:
            require("distributed")
        if self.scheduler:
            # A cluster that is not there is known before anything is made.
            from rfgs_core.schedule.workers import count_workers

            count_workers(self.scheduler)
        return spread


def need_folder(out: Path) -> None:
    """Refuses a place for many parts that is a file.

    Raises:
        RfgsError: It is.
    """
    from rfgs_core.errors import RfgsError

    if out.exists() and not out.is_dir():
        raise RfgsError(f"{out} is a file; expected a folder, choose another")


def watched(
    walk: Callable[[Callable[[str], None]], Iterator[T]], total: int, what: str, unit: str
) -> Iterator[T]:
    """Parts as they come, beside a progress bar.

    Args:
        walk: Yields the parts; is told where to say what is under way.
        total: How many there are.
        what: What the bar is called.
        unit: What a part is called.
    """
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit=unit) as bar:
        for one in walk(bar.set_postfix_str):
            bar.update()
            # Those that are there already come faster than the bar draws itself.
            bar.refresh()
            yield one
