# SPDX-License-Identifier: Apache-2.0
"""Options of commands whose work may be spread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
