# SPDX-License-Identifier: Apache-2.0
"""Progress bars of the stages that find and pose people before frames are fitted."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

from tqdm import tqdm

#: Told what is begun and how many steps it takes; what it gives is called at each step.
Begin = Callable[[str, int], Callable[[], Any]]


def no_bar(_what: str, _steps: int) -> Callable[[], Any]:
    """Begins a stage that nobody watches."""
    return lambda: None


class PoseBars:
    """One bar a stage, as a step of one takes far longer than a step of another."""

    def __init__(self) -> None:
        """No stage is begun."""
        self._bar: tqdm | None = None
        self._what, self._began_s = "", 0.0
        self.step_s: dict[str, float] = {}
        """Time of a step [s] of each stage of which all steps were taken."""

    def __enter__(self) -> PoseBars:
        """The same."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        """Ends the stage that runs."""
        self._end()

    def begin(self, what: str, steps: int) -> Callable[[], Any]:
        """Ends the stage that runs and begins one; see `Begin`."""
        self._end()
        if not steps:
            return lambda: None
        self._bar, self._what = tqdm(total=steps, desc=what), what
        self._began_s = time.perf_counter()
        return self._bar.update

    def _end(self) -> None:
        if self._bar is None:
            return
        if self._bar.n >= self._bar.total > 0:
            self.step_s[self._what] = (time.perf_counter() - self._began_s) / self._bar.n
        self._bar.close()
        self._bar = None
