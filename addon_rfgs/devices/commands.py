# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `devices list`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import bpy

from ..command import Command
from ..files import write_json
from ..scene.frames import file_label, unit_scale
from . import authoring, empties


def _add(parser: Any) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write them as JSON")


def _list(options: argparse.Namespace) -> str:
    unit = unit_scale(bpy.context.scene)
    rows = [authoring.describe(item, unit) for item in empties.devices(bpy.context.scene)]
    if options.json:
        write_json(options.json, rows)
    lines = [
        f"{row['name']}  {row['role'].lower()}  {row['radio']}  at {_point(row['position_m'])} m  "
        f"looks along {_point(row['boresight'])}  tx {row['tx_rows']}x{row['tx_cols']}  "
        f"rx {row['rx_rows']}x{row['rx_cols']}"
        for row in rows
    ]
    return "\n".join(lines) or f"{file_label()}: no radio device"


def _point(values: list[float]) -> str:
    return json.dumps([round(value, 3) for value in values])


LIST = Command(
    "devices list", "Print devices with place, boresight and radio", add=_add, work=_list
)
