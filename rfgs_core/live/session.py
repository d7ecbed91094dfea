# SPDX-License-Identifier: Apache-2.0
"""The loop of a stream: takes packets, closes windows, moves Gaussians, shows them, counts."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from rfgs_core.fit.frame import FrameState
from rfgs_core.live.background import Background
from rfgs_core.live.cloud import Cloud
from rfgs_core.live.counts import Counts, Times
from rfgs_core.live.limbs import LiveLimbs
from rfgs_core.live.setting import Source
from rfgs_core.live.whole_fit import WholeFit
from rfgs_core.live.windows import Windows
from rfgs_core.settings import TrainConfig

#: How long the loop sleeps where nothing is due [s].
_SLEEP_S = 1e-3


@dataclass(frozen=True)
class LiveOptions:
    """How a stream is followed."""

    updates_per_s: float = 25.0
    """Windows, and updates of the Gaussians, in a second."""
    span_s: float = 0.004
    """Packets of so long before the end of a window are put together [s]."""
    late_s: float = 0.01
    """How long a window waits for packets that are on their way [s]."""
    learn_s: float = 3.0
    """How long the background is learned before anything is shown, if nobody recorded it [s]."""
    memory_s: float = 30.0
    """Time constant of the background [s]; who stands still so long becomes part of it."""
    whole_fit_s: float = 5.0
    """A whole fit of a window begins so often, in a process of its own [s]; 0: never."""


class Sink(Protocol):
    """Who is shown every update."""

    def show(self, state: FrameState) -> None:
        """Takes the Gaussians of a window; must not take long."""
        ...


@dataclass
class Tally:
    """What a session did."""

    counts: Mapping[int, Counts]
    """Packets by device."""
    began_s: float
    """When the first cloud was there [s]; NaN before."""
    updates: int = 0
    """Updates of the cloud after the first one."""
    whole_fits: int = 0
    """Whole fits that were finished."""
    latency: Times = field(default_factory=Times)
    """From the arrival of each packet to the cloud that it is part of."""
    ended_s: float = float("nan")
    """When the last cloud was there [s]."""

    @property
    def total(self) -> Counts:
        """Packets of all devices."""
        total = Counts()
        for counts in self.counts.values():
            total = total.plus(counts)
        return total

    @property
    def updates_per_s(self) -> float:
        """Updates per second since the first cloud; 0 without any."""
        elapsed_s = self.ended_s - self.began_s
        return self.updates / elapsed_s if elapsed_s > 0 else 0.0


class Session:
    """A stream and the Gaussians that follow it."""

    def __init__(
        self,
        source: Source,
        counts: Mapping[int, Counts],
        config: TrainConfig,
        options: LiveOptions,
        sinks: Sequence[Sink] = (),
        limbs: LiveLimbs | None = None,
    ) -> None:
        """Prepares everything; nothing is taken yet.

        Args:
            source: Where packets come from.
            counts: Where they are counted, by device.
            config: Gaussians, bodies and solver of the short step.
            options: How the stream is followed.
            sinks: Who is shown every update.
            limbs: Tells how bodies hold themselves; None: nobody does.
        """
        self._source, self._sinks, self._options = source, list(sinks), options
        step_s = 1.0 / options.updates_per_s
        self._windows = Windows(source.setting, counts, step_s, min(options.span_s, step_s))
        self._background = Background(source.setting, options.learn_s, options.memory_s)
        self.cloud = Cloud(config, config.seed, limbs)
        self.tally = Tally(counts, float("nan"))
        self._whole = WholeFit(config) if options.whole_fit_s > 0 else None
        self._offered_s = -float("inf")

    def run(self, limit_s: float | None = None) -> None:
        """Follows the stream until it ends, or for a while [s].

        Raises:
            KeyboardInterrupt: The user stopped it.
        """
        end_s = float("inf") if limit_s is None else time.monotonic() + limit_s
        # The last packets wait for the end of their window.
        rest_s = 2.0 / self._options.updates_per_s + self._options.late_s
        while (now_s := time.monotonic()) < end_s:
            if self._source.ended:
                end_s = min(end_s, now_s + rest_s)
            if not self.step(now_s):
                time.sleep(_SLEEP_S)

    def step(self, now_s: float) -> bool:
        """Takes what came, and updates the cloud if a window is over; whether it was."""
        self._windows.add(self._source.take(now_s))
        due_s = self._windows.due(now_s - self._options.late_s)
        if due_s is None:
            return False
        window = self._windows.close(due_s)
        self._background.learn(window)
        observations = self._background.change(window)
        if not observations.links.any():
            return True
        self._exchange(due_s)
        first = self.cloud.state is None
        state = self.cloud.update(observations)
        if state is None:
            return True
        for sink in self._sinks:
            sink.show(state)
        done_s = time.monotonic()
        if first:
            self.tally.began_s = self.tally.ended_s = done_s
        else:
            self.tally.updates += 1
            self.tally.ended_s = done_s
            self.tally.latency.add(done_s - window.arrived_s)
        if self._whole is not None and due_s - self._offered_s >= self._options.whole_fit_s:
            self._whole.offer(observations)
            self._offered_s = due_s
        return True

    def finish(self, limit_s: float = 10.0) -> None:
        """Takes what is still on its way, and closes the last window whole or not.

        Args:
            limit_s: Gives up after so long [s].
        """
        end_s = time.monotonic() + limit_s
        more = True
        while more and time.monotonic() < end_s:
            more = self.step(time.monotonic())
        self._windows.close(float("inf"))

    def close(self) -> None:
        """Ends the source and the process of whole fits."""
        self._source.close()
        if self._whole is not None:
            self.tally.whole_fits = self._whole.done
            self._whole.close()

    def _exchange(self, now_s: float) -> None:
        """Takes a whole fit that was finished."""
        fitted = self._whole.result() if self._whole is not None else None
        if fitted is not None:
            self.cloud.take(fitted)
        self.tally.whole_fits = self._whole.done if self._whole is not None else 0
