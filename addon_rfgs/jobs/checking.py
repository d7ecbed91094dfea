# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks the Python environment what it holds, while Blender goes on."""

from __future__ import annotations

from pathlib import Path

from .environment import check_arguments, read_check
from .question import Question

#: How long the environment may take to answer [s]; first imports from a slow disk take long.
_PATIENCE_S = 120.0


class Check:
    """The last question and its answer."""

    def __init__(self) -> None:
        self.versions: list[str] = []
        self.problems: list[str] = []
        self._question: Question | None = None

    @property
    def running(self) -> bool:
        """Whether the answer is awaited."""
        return self._question is not None

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
        self._question = Question(check_arguments(python, blender), _PATIENCE_S)

    def step(self) -> bool:
        """Looks for the answer; whether it is still awaited."""
        if self._question is None:
            return False
        if self._question.step():
            return True
        self.versions, self.problems = read_check(self._question.code, self._question.answer)
        self._question = None
        return False

    def cancel(self) -> None:
        """Stops waiting."""
        if self._question is not None:
            self._question.cancel()
            self._question = None


CHECK = Check()
