# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: what a file that shows its Gaussians looks like once it is opened."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy


def play(stage: Any) -> Iterator[float]:
    """Nothing is pressed: the tab is turned to by itself."""
    yield from stage.wait(lambda: category(stage) == "RF-GS", "the tab", 60)
    space = stage.view.spaces.active
    row = {
        "shading": [space.shading.type, space.shading.color_type],
        "through": space.region_3d.view_perspective,
        "frame": bpy.context.scene.frame_current,
        "truth": sorted(
            item.name for item in bpy.context.scene.objects if item.display_type == "WIRE"
        ),
    }
    (stage.out / "told.json").write_text(json.dumps(row))
    yield from stage.shoot("opened")


def category(stage: Any) -> str:
    """The tab in front; a sidebar that was never drawn has none."""
    return str(getattr(stage.sidebar, "active_panel_category", ""))
