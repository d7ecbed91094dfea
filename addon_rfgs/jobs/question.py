# SPDX-License-Identifier: GPL-3.0-or-later
"""A short program whose answer is awaited, while Blender goes on or not."""

from __future__ import annotations

import subprocess
import tempfile
import time

from ..errors import AddonError
from .environment import child_environment

#: How much of an answer is read [bytes].
_LONGEST = 1 << 20
_EVERY_S = 0.1


class Question:
    """A program that was started, and what it answers."""

    def __init__(self, arguments: list[str], patience_s: float) -> None:
        """Asks.

        Args:
            arguments: The program's path and arguments; no shell reads them.
            patience_s: How long it may take.

        Raises:
            AddonError: The program cannot be started.
        """
        self.code: int | None = None
        """Exit code; None if there is none yet, or none within `patience_s`."""
        self.answer = ""
        """What the program wrote, once it is over."""
        self._output = tempfile.TemporaryFile()
        try:
            self._child: subprocess.Popen[bytes] | None = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
                env=child_environment(),
            )
        except OSError as error:
            self._output.close()
            raise AddonError(f"{arguments[0]}: cannot be started: {error.strerror}") from error
        self._end_s = time.monotonic() + patience_s

    def step(self) -> bool:
        """Looks for the answer; whether it is still awaited."""
        if self._child is None:
            return False
        self.code = self._child.poll()
        if self.code is None and time.monotonic() < self._end_s:
            return True
        self._output.seek(0)
        self.answer = self._output.read(_LONGEST).decode("utf-8", "replace")
        self.cancel()
        return False

    def wait(self) -> None:
        """Waits for the answer."""
        while self.step():
            time.sleep(_EVERY_S)

    def cancel(self) -> None:
        """Stops waiting, and ends the program if it is not over."""
        if self._child is not None:
            self._child.kill()
            self._child.wait()
            self._output.close()
            self._child = None
