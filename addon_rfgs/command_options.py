# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several commands share, and how a command tells how far it is."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from .errors import AddonError


def add_scene_options(command: argparse.ArgumentParser) -> None:
    """Which frames, and what the user says about the scene."""
    command.add_argument("--frames", metavar="A:B[:STEP]", help="default: the scene's range")
    command.add_argument("--overrides", type=Path, metavar="FILE", help="JSON, see the docs")


def add_python(command: argparse.ArgumentParser) -> None:
    """Which Python outside of Blender does the work."""
    command.add_argument(
        "--python", default="", metavar="PATH",
        help="Python program or environment with rfgs; default: the preferences' one",
    )  # fmt: skip


def set_number(settings: Any, name: str, value: float) -> None:
    """Sets a number of the panel; Blender would cut off silently what is out of range.

    Raises:
        AddonError: It is out of range.
    """
    spec = type(settings).bl_rna.properties[name]
    if not spec.hard_min <= value <= spec.hard_max:
        option = name.replace("_", "-")
        limits = f"{spec.hard_min:g} to {spec.hard_max:g}"
        raise AddonError(f"--{option} {value:g}: expected {limits}")
    setattr(settings, name, value)


def progress_lines(out: TextIO) -> Callable[[int, int], None]:
    """A callback that writes `progress DONE TOTAL` lines."""

    def report(done: int, total: int) -> None:
        out.write(f"progress {done} {total}\n")
        out.flush()

    return report
