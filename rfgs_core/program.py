# SPDX-License-Identifier: Apache-2.0
"""A command-line program made of commands, each a module of one package."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rfgs_core.files import refuse_inside, refuse_place
from rfgs_core.links import filled
from rfgs_core.outcome import run_cli

#: Arguments of commands that name what they write.
_OUTPUTS = ("out", "json", "video", "picture", "record", "markdown")

#: Seconds between two states of a progress bar in a log, which nobody watches.
_LOGGED_S = "10"


def _say(text: str, code: int) -> int:
    sys.stdout.write(text)
    return code


@dataclass(frozen=True)
class Program:
    """A program and its commands.

    A command's module holds its arguments, a frozen dataclass that says in its docstring what
    the command does, and `run`, which takes them and returns the exit code. A command of several
    parts has a union of such dataclasses instead, and a line on all of them, SUMMARY. Paths of
    arguments that name outputs, as `out` and `json` do, are known to be writable then and to
    belong to no dataset or run, and no link leads out of a folder there.
    """

    name: str
    """What the user types."""
    package: str
    """Where the modules of the commands are."""
    commands: dict[str, tuple[str, str]]
    """Command → module below `package` and name of its arguments."""
    introduction: str
    """Shown above the list of commands."""
    closing: str
    """Shown below it: how to begin."""
    continuing: tuple[str, ...] = ()
    """Commands whose output may be a dataset or a run that is there: they look at it themselves,
    and go on with it or refuse it."""

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Runs one command; returns the exit code.

        Args:
            arguments: Without the program's name; None takes those of the process.
        """
        given = list(sys.argv[1:] if arguments is None else arguments)
        if not sys.stderr.isatty():
            # tqdm reads it as it is imported, with the module of a command.
            os.environ.setdefault("TQDM_MININTERVAL", _LOGGED_S)
        if not given or given[0] in ("-h", "--help"):
            return run_cli(lambda: _say(self.overview(), 0 if given else 2))
        if given == ["--version"]:
            return run_cli(lambda: _say(f"{self.name} {version('rfgs')}\n", 0))
        if given[0] not in self.commands:
            known = ", ".join(self.commands)
            sys.stderr.write(f"error: unknown command {given[0]!r}; expected one of {known}\n")
            return 2
        return run_cli(lambda: self._run(given[0], given[1:]))

    def overview(self) -> str:
        """Help on the program, one line per command."""
        lines = "\n".join(self._summary(name) for name in self.commands)
        return (
            f"usage: {self.name} COMMAND ...\n\n{self.introduction}\n\ncommands:\n{lines}\n\n"
            f"{self.closing}\n`{self.name} COMMAND --help` explains a command, `{self.name} "
            "--version` says which this is.\n"
        )

    def _summary(self, name: str) -> str:
        module, kind = self._command(name)
        # A command of parts has a class of arguments for each of them.
        about = kind.__doc__ if isinstance(kind, type) else module.SUMMARY
        return f"  {name:<10}{(about or '').strip().splitlines()[0]}"

    def _run(self, name: str, arguments: Sequence[str]) -> int | None:
        import tyro

        module, kind = self._command(name)
        run: Callable[[Any], int | None] = module.run
        about = None if isinstance(kind, type) else module.SUMMARY
        parsed = tyro.cli(kind, args=list(arguments), prog=f"{self.name} {name}", description=about)
        with ExitStack() as stack:
            for output in _OUTPUTS:
                place = getattr(parsed, output, None)
                if isinstance(place, Path) and str(place) != "-":
                    refuse_inside(place, itself=name not in self.continuing)
                    refuse_place(place)
                    if place.is_dir():
                        stack.enter_context(filled(place))
            return run(parsed)

    def _command(self, name: str) -> tuple[Any, Any]:
        file, kind = self.commands[name]
        module: Any = importlib.import_module(f"{self.package}.{file}")
        return module, getattr(module, kind)
