# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `remove-data`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

from ..saving import save_copy
from .contents import remove_data


def add_remove_data(commands: Any) -> None:
    """Adds `remove-data` to the commands."""
    command = commands.add_parser(
        "remove-data", help="save a copy of the file without anything of RF-GS"
    )
    command.add_argument("--out", type=Path, required=True, help=".blend to save")
    command.set_defaults(run=_remove_data)


def _remove_data(options: argparse.Namespace, out: TextIO) -> str:
    objects, properties = remove_data()
    save_copy(options.out)
    return (
        f"wrote {options.out}: removed {objects} objects and settings of {properties} data-blocks"
    )
