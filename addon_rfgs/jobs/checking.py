# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks the Python environment what it holds, while Blender goes on."""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

from ..errors import AddonError
from .environment import check_arguments, child_environment, read_check

#: How long the environment may take to answer [s]; first imports from a slow disk take long.
_PATIENCE_S = 120.0


class Check:
    """The last question and its answer."""

    def __init__(self) -> None:
        self.versions: list[str] = []
        self.problems: list[str] = []
        self._child: subprocess.Popen[bytes] | None = None
        self._end_s = 0.0

    @property
    def running(self) -> bool:
        """Whether the answer is awaited."""
        return self._child is not None

    def start(self, python: Path, blender: str) -> None:
        """Asks.

        Args:
            python: The environment's Python.
            blender: The program that opens files for it; empty for the environment's own bpy.

        Raises:
            AddonError: The program cannot be started.
        """
        self.cancel()
        self.versions, self.problems = [], []
        self._output = tempfile.TemporaryFile()
        try:
            self._child = subprocess.Popen(
                check_arguments(python, blender),
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
                env=child_environment(),
            )
        except OSError as error:
            self._output.close()
            raise AddonError(f"{python}: cannot be started: {error.strerror}") from error
        self._end_s = time.monotonic() + _PATIENCE_S

    def step(self) -> bool:
        """Looks for the answer; whether it is still awaited."""
        if self._child is None:
            return False
        code = self._child.poll()
        if code is None and time.monotonic() < self._end_s:
            return True
        self._output.seek(0)
        text = self._output.read(1 << 20).decode("utf-8", "replace")
        self.cancel()
        self.versions, self.problems = read_check(code, text)
        return False

    def cancel(self) -> None:
        """Stops waiting."""
        if self._child is not None:
            self._child.kill()
            self._child.wait()
            self._output.close()
            self._child = None


CHECK = Check()
