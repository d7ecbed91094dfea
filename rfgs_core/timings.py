# SPDX-License-Identifier: Apache-2.0
"""How long each stage of a work takes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Timings(dict[str, float]):
    """Wall time of each stage so far [s], by its name; those that are named begin at 0."""

    def __init__(self, *stages: str) -> None:
        super().__init__(dict.fromkeys(stages, 0.0))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Adds the block's time to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self[name] = self.get(name, 0.0) + time.perf_counter() - start
