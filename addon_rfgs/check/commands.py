# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands `check`, `outline` and `fix` do beside the buttons of the scene check."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import bpy

from ..command import Command
from ..errors import AddonError
from ..saving import save_copy
from ..scene.check import check_scene
from ..scene.findings import Finding
from ..scene.outline import outline
from ..scene.override_file import read_overrides
from ..seals import write_sealed_json
from .repairs import REPAIRABLE, findings, repair, repairable, select_meant


def add_check(parser: Any) -> None:
    """Options of `check` beside those of its button."""
    parser.add_argument("--out", type=Path, help="JSON file of the report; default: print findings")
    parser.add_argument(
        "--select", type=int, metavar="N", help="select what the N-th finding is about, from 1"
    )
    parser.add_argument("--save", type=Path, metavar="BLEND", help=".blend to save with --select")


def check(options: argparse.Namespace) -> str:
    """Prints findings, writes the report, or selects what one is about."""
    if (options.select is None) != (options.save is None):
        raise AddonError("check: --select N and --save FILE.blend belong together")
    report = check_scene(bpy.context.scene, options.frames, _overrides(options))
    rows = [Finding(**row) for row in report["findings"]]
    if options.select is not None:
        if not 1 <= options.select <= len(rows):
            there = f"there are {len(rows)} findings, counted from 1"
            raise AddonError(f"--select {options.select}: {there}")
        item = select_meant(bpy.context, rows[options.select - 1])
        save_copy(options.save)
        return f"selected {item.name}; wrote {options.save}"
    if options.out is None:
        return "\n".join(f"{row.severity}: {row.sentence}" for row in rows) or "nothing to say"
    write_sealed_json(options.out, report)
    return f"wrote {options.out}: {len(rows)} findings"


def _overrides(options: argparse.Namespace) -> Any:
    return read_overrides(Path(options.overrides) if options.overrides else None)


def _add_outline(parser: Any) -> None:
    parser.add_argument("--out", type=Path, required=True, help="JSON file")
    parser.add_argument("--between", action="store_true", help="poses between frames are wanted")


def _outline(options: argparse.Namespace) -> str:
    scene, overrides = bpy.context.scene, _overrides(options)
    found = outline(scene, options.frames, overrides, between=options.between)
    write_sealed_json(options.out, found)
    return f"wrote {options.out}: {len(found['frames'])} frames, {len(found['devices'])} devices"


OUTLINE = Command(
    "outline",
    "Write which frames and devices the file has, without a look at meshes",
    reads={"export": ("frames", "overrides")},
    anew=True,
    add=_add_outline,
    work=_outline,
)


def _add_fix(parser: Any) -> None:
    parser.add_argument(
        "kind", nargs="*", metavar="KIND", help=f"only these of {', '.join(REPAIRABLE)}"
    )


def _fix(options: argparse.Namespace) -> str:
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
    lines += [f"left: {row.severity}: {row.sentence}" for row in left]
    return "\n".join(lines or ["nothing to fix"])


FIX = Command(
    "fix",
    "Repair what the scene check finds, as far as that is safe; what is left is printed",
    saves=True,
    add=_add_fix,
    work=_fix,
)
