# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: every operator that changes the file is undone and done again.

Arguments: folder with `cloud.ply` and `dataset/`, see `leaving_nothing.py`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

#: Operator → its properties, in an order in which each finds what it needs.
STEPS: list[tuple[str, dict[str, Any]]] = [
    ("place_radio", {"radio": "wifi"}),
    ("add_device", {"role": "RECEIVER", "radio": "scene"}),
    ("duplicate_device", {}),
    ("mirror_device", {}),
    ("match_devices", {}),
    ("remove_device", {}),
    ("import_gaussians", {}),
    ("add_crop_box", {}),
    ("update_display", {}),
    ("show_paths", {}),
    ("clear_paths", {}),
    ("remove_data", {}),
    ("import_ply", {"filepath": "{folder}/cloud.ply"}),
]


def play(stage: Any) -> Iterator[float]:
    """Tells for each operator whether it was called, undone and redone."""
    folder = Path(stage.arguments[0])
    yield from stage.open_tab("RFGS_PT_file")
    prepare(folder)
    bpy.ops.ed.undo_push(message="prepared")
    yield 0.5
    told = {}
    for name, properties in STEPS:
        before = contents()
        with stage.override():
            given = {
                key: value.format(folder=folder) if isinstance(value, str) else value
                for key, value in properties.items()
            }
            getattr(bpy.ops.rfgs, name)("EXEC_DEFAULT", True, **given)
        yield 0.3
        after = contents()
        undone = yield from step(stage, bpy.ops.ed.undo)
        redone = yield from step(stage, bpy.ops.ed.redo)
        told[name] = [before != after, undone == before, redone == after]
    (stage.out / "undo.json").write_text(json.dumps(told))


def step(stage: Any, go: Callable[[], Any]) -> Iterator[float]:
    with stage.override():
        go()
    yield 0.3
    return contents()


def prepare(folder: Path) -> None:
    said = bpy.context.scene.rfgs
    said.gaussians.path = str(folder / "cloud.ply")
    said.paths.dataset = str(folder / "dataset")


def contents() -> dict[str, Any]:
    """What there is, and what RF-GS stores in it."""
    kinds = ("objects", "meshes", "curves", "materials", "node_groups", "collections")
    names = {kind: sorted(row.name for row in getattr(bpy.data, kind)) for kind in kinds}
    said = bpy.context.scene.rfgs
    return {
        **names,
        "roles": [(item.name, item.rfgs.role, item.rfgs.radio) for item in bpy.data.objects],
        "shown": [said.gaussians.path, said.gaussians.use_crop, said.paths.dataset],
    }
