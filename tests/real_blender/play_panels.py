# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: every panel of the tab is drawn and photographed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Notes which panels drew, with a mesh and with an Empty as active object."""
    run, dataset = stage.arguments
    settings = bpy.context.scene.rfgs
    # Panels that wait for something: Gaussians, and a dataset.
    settings.gaussians.path, settings.jobs.dataset_folder = run, dataset
    bpy.ops.rfgs.import_gaussians()
    yield from stage.open_tab()
    drawn: set[str] = set()
    for panel in our_panels():
        watch(panel, drawn)
    for item in (bpy.data.objects["Box person"], device()):
        bpy.context.view_layer.objects.active = item
        yield from stage.shoot(f"panels_{item.type.lower()}", "SIDEBAR")
    yield from stage.shoot("window")
    expected = sorted(panel.__name__ for panel in our_panels())
    (stage.out / "drawn.json").write_text(json.dumps([sorted(drawn), expected]))


def our_panels() -> list[type]:
    return [
        kind for kind in bpy.types.Panel.__subclasses__() if kind.__name__.startswith("RFGS_PT_")
    ]


def watch(panel: type, drawn: set[str]) -> None:
    """Notes each time a panel comes to the end of its drawing."""
    draw = panel.draw

    def watched(self: Any, context: bpy.types.Context) -> None:
        draw(self, context)
        drawn.add(panel.__name__)

    panel.draw = watched


def device() -> bpy.types.Object:
    item = bpy.data.objects.new("Access point", None)
    bpy.context.scene.collection.objects.link(item)
    item.location = (0.3, 0.3, 1.5)
    item.rfgs.role = "ACCESS_POINT"
    return item
