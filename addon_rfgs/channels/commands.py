# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `csi`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import add_python, set_number
from ..jobs.environment import interpreter
from ..jobs.preferences import environment_path
from .drawing import begin


def add_csi(commands: Any) -> None:
    """Adds `csi` to the commands."""
    command = commands.add_parser(
        "csi",
        help="draw measured and predicted channels of a link with rfgs",
        description="Draws csi − csi_static of a link over tones and path length for every frame, "
        "measured above predicted, as a PNG; what is left out is taken from the panel's settings.",
    )
    command.add_argument("--run", dest="run_folder", metavar="FOLDER", help="of the training")
    command.add_argument("--tx-device", type=int, metavar="N", help="transmitter, from 0")
    command.add_argument(
        "--rx-device", type=int, metavar="N", help="receiver; -1: the first that hears it"
    )
    command.add_argument("--out", type=Path, help="PNG to write (RUN/predictions/link_TX_RX.png)")
    add_python(command)
    command.set_defaults(run=_csi)


def _csi(options: argparse.Namespace, out: TextIO) -> str:
    settings = bpy.context.scene.rfgs.channels
    if options.run_folder:
        settings.run_folder = os.path.abspath(options.run_folder)
    for name in ("tx_device", "rx_device"):
        if getattr(options, name) is not None:
            set_number(settings, name, getattr(options, name))
    python = interpreter(options.python or environment_path())
    path = Path(os.path.abspath(options.out)) if options.out else None
    drawing = begin(bpy.context.scene, python, path)
    drawing.question.wait()
    return f"{drawing.out}: {drawing.outcome()}"
