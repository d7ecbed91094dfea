# SPDX-License-Identifier: GPL-3.0-or-later
"""Code inside a file: never run, always named."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from .findings import Finding
from .state import Keeper


def disabled_drivers() -> list[dict[str, Any]]:
    """Drivers that need Python, which never runs from a file; their values stay as saved."""
    return [
        {
            "what": "driver",
            "object": f"{name}: {curve.data_path}",
            "value": "disabled",
            "why": "scripts in a file never run",
        }
        for name, owner in _animated()
        for curve in owner.animation_data.drivers
        if curve.driver.type == "SCRIPTED" and not curve.driver.is_simple_expression
    ]


def close_scripted_file() -> None:
    """Closes a file with refused drivers: with one open, Blender as a module never ends."""
    if disabled_drivers():
        bpy.ops.wm.read_factory_settings(use_empty=True)


def startup_texts() -> list[Finding]:
    """Text blocks that ask to be run when the file opens."""
    return [
        Finding("info", "the scene", f"text {text.name!r} asks to run on opening; it does not")
        for text in bpy.data.texts
        if text.use_module
    ]


def disable_scripts(keeper: Keeper, scene: bpy.types.Scene) -> None:
    """Turns off what runs Python or shader scripts of a file while it renders."""
    keeper.set(scene.render, "use_freestyle", False)
    if hasattr(scene, "cycles"):
        keeper.set(scene.cycles, "shading_system", False)


def _animated() -> Iterator[tuple[str, Any]]:
    """Every animated data block and its name, that of the owner for node trees and shape keys."""
    seen = set()
    for name in dir(bpy.data):
        blocks = getattr(bpy.data, name)
        if not isinstance(blocks, bpy.types.bpy_prop_collection):
            continue
        for block in blocks:
            for owner in (
                block,
                getattr(block, "node_tree", None),
                getattr(block, "shape_keys", None),
            ):
                data = getattr(owner, "animation_data", None)
                if data is not None and owner.as_pointer() not in seen:
                    seen.add(owner.as_pointer())
                    yield block.name, owner
