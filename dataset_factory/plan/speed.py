# SPDX-License-Identifier: Apache-2.0
"""How fast a stage goes: a start that is paid once, then equal steps."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Speed:
    """A stage's speed on this machine."""

    start_s: float
    """Time before work begins: loading programs, scenes and kernels [s]."""
    step_s: float
    """Time from one finished step to the next, all processes together [s]."""

    def seconds(self, steps: int) -> float:
        """Time that a stage of so many steps takes."""
        return self.start_s + self.step_s * steps


@dataclass
class Clock:
    """Notes when a stage begins and when its steps end."""

    at_once: int = 1
    """Steps that are worked on at the same time; the first of each process tell the start only."""
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
        counted = len(self.ends_s) - self.at_once
        if counted < self.at_once:
            return None
        step_s = (self.ends_s[-1] - self.ends_s[self.at_once - 1]) / counted
        start_s = max(self.ends_s[-1] - self.began_s - step_s * len(self.ends_s), 0.0)
        return Speed(round(start_s, 3), round(step_s, 4))
