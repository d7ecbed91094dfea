# SPDX-License-Identifier: Apache-2.0
"""One tracing process, seen from outside: asked line by line, watched while it answers."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from typing import IO, Any

import psutil

from dataset_factory.children import child_environment, end_with_parent

#: How often a process that is at work is looked at [s].
_LOOK_EVERY_S = 0.5

#: One library's worker pool inside each process would make processes fight for cores.
_SINGLE_THREADED = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}


class LostProcessError(Exception):
    """The process is gone without an answer; the message says why."""


class TracingProcess:
    """`python -m dataset_factory.worker`, see there for what it is asked."""

    def __init__(self, log: IO[str], memory_bytes: int) -> None:
        """Starts the process.

        Args:
            log: Where its own output goes.
            memory_bytes: It is killed when it takes more.
        """
        self._memory_bytes = memory_bytes
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dataset_factory.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            env=child_environment(**_SINGLE_THREADED),
            # Ctrl-C reaches the parent alone, which then ends its workers.
            start_new_session=True,
            preexec_fn=end_with_parent,
        )
        self._watched = psutil.Process(self._process.pid)

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Sends one request and waits for the answer.

        Raises:
            LostProcessError: The process ended, or was killed for its memory.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request).encode("utf-8") + b"\n")
            self._process.stdin.flush()
        except (BrokenPipeError, ValueError) as error:
            raise self._lost() from error
        return json.loads(self._line())

    def memory_bytes(self) -> int:
        """Resident memory of the process now, 0 if it is gone."""
        try:
            return self._watched.memory_info().rss
        except psutil.Error:
            return 0

    def end(self) -> None:
        """Ends the process and waits until it is gone."""
        self._process.kill()
        self._process.wait()

    def _line(self) -> bytes:
        """The answer; one line, as the process is asked one thing at a time."""
        assert self._process.stdout is not None
        answer = self._process.stdout.fileno()
        line = b""
        while not line.endswith(b"\n"):
            if select.select([answer], [], [], _LOOK_EVERY_S)[0]:
                part = os.read(answer, 1 << 16)
                if not part:
                    raise self._lost()
                line += part
            elif self.memory_bytes() > self._memory_bytes:
                self.end()
                raise LostProcessError(
                    f"a tracing process took more than {self._memory_bytes / 1e9:.1f} GB; "
                    "raise --worker-memory or lower --workers"
                )
        return line

    def _lost(self) -> LostProcessError:
        return LostProcessError(f"a tracing process ended with code {self._process.wait()}")
