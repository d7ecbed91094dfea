# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussians from File › Import, or dropped into a 3D view."""

from __future__ import annotations

from typing import Any

import bpy

from ..reporting import Progress, Undoable, chosen_path
from .operators import import_shown

_LABEL = "RF Gaussians (.ply)"


class RFGS_OT_import_ply(Undoable, bpy.types.Operator):
    """Bring the Gaussians of a PLY into the scene, shown as the Gaussians panel says."""

    bl_label = "Import RF Gaussians"

    # Not remembered: a path that is there was dropped, and nobody has to be asked.
    filepath: bpy.props.StringProperty(
        name="File",
        description="PLY in the 3DGS convention, or the folder of a run",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: bpy.props.StringProperty(
        name="Filter", description="Which files are listed", default="*.ply", options={"HIDDEN"}
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Asks which, unless a file was dropped."""
        if self.filepath:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports, and lets the panel name what is here."""
        path = chosen_path(self.filepath)
        told = import_shown(context, path)
        context.scene.rfgs.gaussians.path = str(path)
        return told


class RFGS_FH_gaussians(bpy.types.FileHandler):
    """Takes a PLY that is dropped; Blender asks which importer is meant if there are several."""

    bl_label = "RF Gaussians"
    bl_import_operator = "rfgs.import_ply"
    bl_file_extensions = ".ply"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Where the scene is seen."""
        return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}


def _draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("rfgs.import_ply", text=_LABEL)


def register() -> None:
    """Adds the entry of the menu."""
    bpy.types.TOPBAR_MT_file_import.append(_draw)


def unregister() -> None:
    """Takes the entry out of the menu."""
    bpy.types.TOPBAR_MT_file_import.remove(_draw)
