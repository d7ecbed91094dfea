# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around maps of coverage."""

from __future__ import annotations

import bpy
import numpy as np

from ..command import Command
from ..gaussians.opening import color_view, views_of
from ..reporting import Progress, Undoable, chosen_path
from .surface import clear_coverage, coverages, read_map, show_coverage


class RFGS_OT_show_coverage(Undoable, bpy.types.Operator):
    """Show how loud a transmitter is over a level plane, as a surface coloured in dB."""

    bl_label = "Show Coverage"
    command = Command(
        "coverage",
        reads={"coverage": ("path", "tx_device")},
        words={"path": "--map", "tx_device": "--tx"},
        instead={"--clear": "clear_coverage"},
        saves=True,
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Reads the map that the panel names."""
        said = context.scene.rfgs.coverage
        found = read_map(chosen_path(said.path))
        item = show_coverage(context.scene, found, said.tx_device)
        for space in views_of(context.screen):
            if space.shading.type == "SOLID":
                color_view(space)
        gain_db = found.of(said.tx_device)[1]
        share = 100.0 * np.isfinite(gain_db).mean()
        return f"{item.name}: median {np.nanmedian(gain_db):.0f} dB, heard in {share:.0f} %"


class RFGS_OT_clear_coverage(Undoable, bpy.types.Operator):
    """Remove every map of coverage from the file."""

    bl_label = "Clear Coverage"

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """There is one."""
        there = bool(coverages())
        if not there:
            cls.poll_message_set("No coverage is shown")
        return there

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes surfaces."""
        return f"Removed {clear_coverage()} maps"
