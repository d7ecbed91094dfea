# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several commands share, and how a command tells how far it is."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TextIO


def add_scene_options(command: argparse.ArgumentParser) -> None:
    """Which frames, and what the user says about the scene."""
    command.add_argument("--frames", metavar="A:B[:STEP]", help="default: the scene's range")
    command.add_argument("--overrides", type=Path, metavar="FILE", help="JSON, see the docs")


def progress_lines(out: TextIO) -> Callable[[int, int], None]:
    """A callback that writes `progress DONE TOTAL` lines."""

    def report(done: int, total: int) -> None:
        out.write(f"progress {done} {total}\n")
        out.flush()

    return report
