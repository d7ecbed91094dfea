# SPDX-License-Identifier: Apache-2.0
"""Whole fits of single windows, in a process of their own beside the stream."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from multiprocessing.connection import Connection

from rfgs_core.fit.frame import FrameState
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: How much the process yields to everything else.
_NICE = 10
#: It is waited for so long when it is told to end [s].
_GRACE_S = 2.0


class WholeFit:
    """A process that fits one window at a time, as `rfgs train` fits a frame."""

    def __init__(self, config: TrainConfig) -> None:
        """Starts the process.

        Args:
            config: Settings of its fits.
        """
        context = multiprocessing.get_context("spawn")
        self._ours, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, config), daemon=True)
        self._process.start()
        theirs.close()
        self._busy = False
        self.done = 0
        """Fits that were finished."""

    def offer(self, observations: Observations) -> None:
        """Lets it fit a window if it has nothing else to do."""
        if not self._busy:
            with contextlib.suppress(OSError):
                self._ours.send(observations)
                self._busy = True

    def result(self) -> FrameState | None:
        """A fit that was finished since the last call, if any; one that failed counts as none."""
        try:
            if not self._busy or not self._ours.poll():
                return None
            fitted = self._ours.recv()
        except (EOFError, OSError):
            return None
        self._busy = False
        self.done += fitted is not None
        return fitted

    def close(self) -> None:
        """Ends the process, whatever it does."""
        self._ours.close()
        self._process.terminate()
        self._process.join(_GRACE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _serve(pipe: Connection, config: TrainConfig) -> None:
    """Fits what comes until the other end is closed."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.fit.frame import start_frame
    from rfgs_core.fit.stages import fit_frame
    from rfgs_core.threads import one_torch_thread

    # Ctrl-C is for the program that started this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICE)
    with one_torch_thread(), contextlib.suppress(EOFError, OSError):
        while True:
            observations = pipe.recv()
            try:
                state = start_frame(observations, config, config.seed, None)
                fitted = fit_frame(observations, state, config, config.seed)
            except RfgsError:
                fitted = None
            pipe.send(fitted)
