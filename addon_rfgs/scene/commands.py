# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `check`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import add_scene_options
from ..files import write_json
from .check import check_scene
from .findings import Finding
from .override_file import read_overrides


def add_check(commands: Any) -> None:
    """Adds `check` to the commands."""
    check = commands.add_parser("check", help="say what the scene holds and what is guessed")
    check.add_argument("--out", type=Path, help="JSON file of the report; default: print findings")
    add_scene_options(check)
    check.set_defaults(run=_check)


def _check(options: argparse.Namespace, out: TextIO) -> str:
    overrides = read_overrides(options.overrides)
    report = check_scene(bpy.context.scene, options.frames, overrides)
    if options.out is None:
        rows = [Finding(**row) for row in report["findings"]]
        return "\n".join(f"{row.severity}: {row.sentence}" for row in rows) or "nothing to say"
    write_json(options.out, report)
    return f"wrote {options.out}: {len(report['findings'])} findings"
