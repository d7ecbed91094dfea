# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `paths`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import set_number
from ..saving import save_copy
from .curves import clear_paths
from .operators import show_settings


def add_paths(commands: Any) -> None:
    """Adds `paths` to the commands."""
    command = commands.add_parser(
        "paths",
        help="show traced paths as curves coloured by power",
        description="Adds a curve object per link and frame for traced paths; what is left out is "
        "taken from the panel's settings.",
    )
    command.add_argument("--dataset", help="generated with ray paths")
    command.add_argument("--out", type=Path, required=True, help=".blend to save")
    command.add_argument("--radio", help="default: the dataset's first")
    command.add_argument("--frame", type=int, help="this one alone; default: all, on the timeline")
    command.add_argument("--static", action="store_true", help="without anything that moves")
    command.add_argument("--tx", dest="tx_device", type=int, help="device, from 0; -1: all")
    command.add_argument("--rx", dest="rx_device", type=int, help="device, from 0; -1: all")
    command.add_argument("--count", type=int, help="at most so many paths of a link")
    command.add_argument("--range-db", type=float, help="below the strongest one")
    command.add_argument("--clear", action="store_true", help="remove all paths instead")
    command.set_defaults(run=_paths)


def _paths(options: argparse.Namespace, out: TextIO) -> str:
    scene = bpy.context.scene
    if options.clear:
        _, links = clear_paths()
        told = f"removed the paths of {links} links"
    else:
        if options.frame is not None:
            scene.frame_set(options.frame)
            scene.rfgs.paths.follow = False
        if options.dataset:
            scene.rfgs.paths.dataset = os.path.abspath(options.dataset)
        if options.static:
            scene.rfgs.paths.static = True
        if options.radio is not None:
            scene.rfgs.paths.radio = options.radio
        for name in ("tx_device", "rx_device", "count", "range_db"):
            if getattr(options, name) is not None:
                set_number(scene.rfgs.paths, name, getattr(options, name))
        told = show_settings(scene)
    save_copy(options.out)
    return f"wrote {options.out}: {told}"
