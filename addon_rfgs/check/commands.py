# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands `check`, `outline` and `fix`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, TextIO

import bpy

from ..command_options import add_scene_options
from ..errors import AddonError
from ..files import write_json
from ..saving import save_copy
from ..scene.check import check_scene
from ..scene.findings import Finding
from ..scene.outline import outline
from ..scene.override_file import read_overrides
from .repairs import REPAIRABLE, findings, repair, repairable, select_meant


def add_check(commands: Any) -> None:
    """Adds `check` to the commands."""
    check = commands.add_parser(
        "check",
        help="say what the scene holds and what is guessed",
        description="Lists what would go wrong with the scene, the worst first.",
    )
    check.add_argument("--out", type=Path, help="JSON file of the report; default: print findings")
    check.add_argument(
        "--select", type=int, metavar="N", help="select what the N-th finding is about, from 1"
    )
    check.add_argument("--save", type=Path, metavar="BLEND", help=".blend to save with --select")
    add_scene_options(check)
    check.set_defaults(run=_check)


def _check(options: argparse.Namespace, _out: TextIO) -> str:
    if (options.select is None) != (options.save is None):
        raise AddonError("check: --select N and --save FILE.blend belong together")
    overrides = read_overrides(options.overrides)
    report = check_scene(bpy.context.scene, options.frames, overrides)
    rows = [Finding(**row) for row in report["findings"]]
    if options.select is not None:
        return _save_selected(rows, options.select, options.save)
    if options.out is None:
        return "\n".join(f"{row.severity}: {row.sentence}" for row in rows) or "nothing to say"
    write_json(options.out, report)
    return f"wrote {options.out}: {len(rows)} findings"


def _save_selected(rows: list[Finding], number: int, path: Path) -> str:
    if not 1 <= number <= len(rows):
        raise AddonError(f"--select {number}: there are {len(rows)} findings, counted from 1")
    item = select_meant(bpy.context, rows[number - 1])
    save_copy(path)
    return f"selected {item.name}; wrote {path}"


def add_outline(commands: Any) -> None:
    """Adds `outline` to the commands."""
    command = commands.add_parser(
        "outline", help="write which frames and devices the file has, without a look at meshes"
    )
    command.add_argument("--out", type=Path, required=True, help="JSON file")
    command.add_argument("--between", action="store_true", help="poses between frames are wanted")
    add_scene_options(command)
    command.set_defaults(run=_outline)


def _outline(options: argparse.Namespace, _out: TextIO) -> str:
    overrides = read_overrides(options.overrides)
    found = outline(bpy.context.scene, options.frames, overrides, between=options.between)
    write_json(options.out, found)
    return f"wrote {options.out}: {len(found['frames'])} frames, {len(found['devices'])} devices"


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
