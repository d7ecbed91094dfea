# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `fix`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..errors import AddonError
from ..saving import save_copy
from .repairs import REPAIRABLE, findings, repair, repairable


def add_fix(commands: Any) -> None:
    """Adds `fix` to the commands."""
    fix = commands.add_parser(
        "fix",
        help="repair what the scene check finds, as far as that is safe",
        description="Repairs findings one after the other; what is left is printed at the end.",
    )
    fix.add_argument(
        "kind", nargs="*", metavar="KIND", help=f"only these of {', '.join(REPAIRABLE)}"
    )
    fix.add_argument("--out", type=Path, required=True, help=".blend to save")
    fix.set_defaults(run=_fix)


def _fix(options: argparse.Namespace, _out: TextIO) -> str:
    scene = bpy.context.scene
    wanted = options.kind or list(REPAIRABLE)
    unknown = sorted(set(wanted) - set(REPAIRABLE))
    if unknown:
        raise AddonError(f"unknown kind {unknown[0]!r}; expected one of {', '.join(REPAIRABLE)}")
    lines: list[str] = []
    tried = set()
    while True:
        # A repair may change what else there is to find.
        left = findings(scene)
        todo = [row for row in left if row.kind in wanted and row not in tried]
        todo = [row for row in todo if repairable(scene, row)]
        if not todo:
            break
        tried.add(todo[0])
        try:
            lines.append(f"fixed: {repair(scene, todo[0])}")
        except AddonError as error:
            lines.append(f"not fixed: {error}")
        bpy.context.view_layer.update()
    save_copy(options.out)
    lines += [f"left: {row.severity}: {row.sentence}" for row in left]
    return "\n".join([*lines, f"wrote {options.out}"])
