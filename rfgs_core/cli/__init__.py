# SPDX-License-Identifier: Apache-2.0
"""The `rfgs` command: train, evaluate and look at radio Gaussians."""

from __future__ import annotations

import importlib
import logging
import sys
from collections.abc import Callable, Sequence
from typing import Any

import tyro

from rfgs_core.errors import run_cli

#: Command name → module below `rfgs_core.cli` and its arguments dataclass.
COMMANDS: dict[str, tuple[str, str]] = {
    "info": ("info", "InfoArgs"),
    "demo": ("demo", "DemoArgs"),
    "train": ("train", "TrainArgs"),
    "eval": ("eval", "EvalArgs"),
    "render": ("render", "RenderArgs"),
    "export": ("export", "ExportArgs"),
    "report": ("report", "ReportArgs"),
    "compare": ("compare", "CompareArgs"),
    "bench": ("bench", "BenchArgs"),
}

_HELP = """usage: rfgs COMMAND ...

Radio-frequency Gaussian splatting: fits 3D Gaussians to channel state information alone.

commands:
{commands}

Start with `rfgs info`, then `rfgs demo`. `rfgs COMMAND --help` explains a command.
"""


def _summary(name: str) -> str:
    module, arguments = COMMANDS[name]
    doc = getattr(importlib.import_module(f"rfgs_core.cli.{module}"), arguments).__doc__
    return f"  {name:<10}{(doc or '').strip().splitlines()[0]}"


def _overview() -> str:
    return _HELP.format(commands="\n".join(_summary(name) for name in COMMANDS))


def _command(name: str, arguments: Sequence[str]) -> int | None:
    module_name, class_name = COMMANDS[name]
    module: Any = importlib.import_module(f"rfgs_core.cli.{module_name}")
    parsed = tyro.cli(getattr(module, class_name), args=list(arguments), prog=f"rfgs {name}")
    run: Callable[[Any], int | None] = module.run
    return run(parsed)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `rfgs`; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    if not given or given[0] in ("-h", "--help"):
        sys.stdout.write(_overview())
        return 0 if given else 2
    if given[0] not in COMMANDS:
        sys.stderr.write(
            f"error: unknown command {given[0]!r}; expected one of {', '.join(COMMANDS)}\n"
        )
        return 2
    return run_cli(lambda: _command(given[0], given[1:]))
