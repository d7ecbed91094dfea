# SPDX-License-Identifier: Apache-2.0
"""Traces one frame after the other in a process that is replaced when it grows or dies."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dataset_factory.tracing_process import LostProcessError, TracingProcess

#: A process is replaced after this many frames, whatever it holds: a start costs seconds.
RECYCLE_FRAMES = 300
#: Share of the memory limit beyond which a process is replaced between frames.
RECYCLE_SHARE = 0.8
#: How often a frame is tried whose process dies.
_ATTEMPTS = 2


@dataclass(frozen=True)
class Limits:
    """What one tracing process may take."""

    memory_bytes: int
    """Beyond it the process is killed; beyond `RECYCLE_SHARE` of it, replaced after its frame."""
    frames: int = RECYCLE_FRAMES
    """Frames after which it is replaced."""


class Lane:
    """One tracing process at a time.

    The process lives as long as the thread that calls `trace`: it ends with it.
    """

    def __init__(self, job: dict[str, Any], log: Path, limits: Limits) -> None:
        """Starts nothing yet.

        Args:
            job: What the process needs to know, see `dataset_factory.worker`.
            log: File of its own output.
            limits: When it is replaced.
        """
        self._job, self._limits = job, limits
        self._log = log.open("w")
        self._process: TracingProcess | None = None
        self._frames = 0
        self._ended = False
        self._lock = threading.Lock()
        self.started = 0
        """How many processes there have been."""

    def trace(self, request: dict[str, Any]) -> dict[str, Any]:
        """Has one frame traced; a frame whose process dies gets a second one.

        Args:
            request: The frame, as `dataset_factory.worker` takes it.

        Returns:
            The answer of the process and its `memory_bytes` after the frame, or `error` with
            the reason; `crash` if it is not the user's mistake. The next frame gets another
            process after an error.
        """
        reason = ""
        for _ in range(_ATTEMPTS):
            try:
                reply = self._ask(request)
            except LostProcessError as error:
                reason = str(error)
                self._drop()
                if self._ended:
                    break
            else:
                if "error" in reply:
                    # A process that has not begun would take the next frame for its job.
                    self._drop()
                    return reply
                return {**reply, "memory_bytes": self._recycle()}
        return {"error": f"{reason} (tried twice)", "crash": True}

    def end(self) -> None:
        """Ends the process at once; another thread may be waiting for it."""
        with self._lock:
            self._ended = True
            if self._process:
                self._process.end()
        self._log.close()

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        if self._process is None:
            self._start()
            assert self._process is not None
            reply = self._process.ask(self._job)
            if "error" in reply:
                return reply
        self._frames += 1
        return self._process.ask(request)

    def _start(self) -> None:
        with self._lock:
            if self._ended:
                raise LostProcessError("the run is stopping")
            self._process = TracingProcess(self._log, self._limits.memory_bytes)
            self._frames = 0
            self.started += 1

    def _recycle(self) -> int:
        """Replaces the process if it is full; returns the memory that it held."""
        assert self._process is not None
        memory = self._process.memory_bytes()
        full = memory > RECYCLE_SHARE * self._limits.memory_bytes
        if full or self._frames >= self._limits.frames:
            self._drop()
        return memory

    def _drop(self) -> None:
        with self._lock:
            if self._process:
                self._process.end()
            self._process = None
