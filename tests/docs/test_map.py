# SPDX-License-Identifier: Apache-2.0
"""Rooms of `rfgs_core` import what stands above them in the map of DEVELOPMENT.md."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "DEVELOPMENT.md").read_text("utf-8")
#: Rooms in the order of the map, as dotted names.
ROOMS = [
    name.removesuffix(".py").replace("/", ".")
    for name in re.findall(r"^\| `(rfgs_core/[\w/.]+)` \|", TEXT, re.MULTILINE)
]


def room_of(module: str) -> str | None:
    """The innermost room that a module belongs to; None of files beside the rooms."""
    around = [room for room in ROOMS if f"{module}.".startswith(f"{room}.")]
    return max(around, key=len, default=None)


def imported(path: Path) -> set[str]:
    """Modules of `rfgs_core` that a file imports, at its top or anywhere within."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module == "rfgs_core":
            names |= {f"rfgs_core.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return {name for name in names if name.startswith("rfgs_core.")}


def test_every_folder_is_on_the_map() -> None:
    folders = {f"rfgs_core.{path.parent.name}" for path in ROOT.glob("rfgs_core/*/__init__.py")}
    assert folders == {room for room in ROOMS if room.count(".") == 1} & folders
    assert len(ROOMS) == len(set(ROOMS)) > 15


def test_nothing_imports_from_a_room_below() -> None:
    upward = []
    for path in sorted(ROOT.glob("rfgs_core/*/**/*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        room = room_of(module)
        assert room is not None
        for name in sorted(imported(path)):
            other = room_of(name)
            if other is not None and ROOMS.index(other) > ROOMS.index(room):
                upward.append(f"{module} imports {name}")
    assert not upward
