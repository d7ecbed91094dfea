# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that bring Gaussians in, write them out and compare them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ..command import Command
from ..reporting import Progress, Undoable, chosen_path
from ..scene.frames import named
from . import commands
from .clouds import chosen_clouds, clouds_of, import_gaussians, path_or_run
from .compare import compare_with_mesh, keep_result
from .export_ply import export_gaussians
from .opening import color_solid_views, hide_bones
from .with_clouds import WithClouds


class RFGS_OT_import_gaussians(Undoable, bpy.types.Operator):
    """Bring the Gaussians of a run, or of one PLY, into the scene."""

    bl_label = "Import Gaussians"
    command = Command(
        "import",
        "Bring Gaussians back beside the scene\n\nBrings the Gaussians of a run, a folder of "
        "000001.ply and so on, or one 3DGS PLY (text or binary) into the file, keyed on its "
        "timeline; writes a .blend that needs no add-on to play, a picture beside the true scene, "
        "or both.",
        reads={
            "gaussians": (
                *("path", "display_mode", "size", "opacity_threshold", "power_threshold_db"),
                *("solid_view", "use_crop", "crop_box", "color_by", "color_attribute"),
                *("use_range", "range_low", "range_high", "frame_offset", "interpolation"),
            )
        },
        anew=True,
        words={
            "path": "path",
            "display_mode": "--mode",
            "power_threshold_db": "--power-threshold",
            "color_attribute": "--attribute",
        },
        together={"--range LOW HIGH": ("range_low", "range_high")},
        means={"--range": {"use_range": True}, "--crop-box": {"use_crop": True}},
        add=commands.add_import,
        work=commands.import_,
    )

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Imports with the panel's settings."""
        return import_shown(context, chosen_path(path_or_run(context.scene)))


def import_shown(context: bpy.types.Context, path: Path) -> str:
    """Imports with the settings of the panel, at a frame that has Gaussians, seen in colour.

    Returns:
        One line about it.

    Raises:
        AddonError: There is nothing to import, or a file is damaged; nothing has changed then.
    """
    scene = context.scene
    wanted = replace(scene.rfgs.gaussians.inspection(), fall_back=True)
    done = import_gaussians(scene, path, wanted)
    if done.frames and not done.frames[0] <= scene.frame_current <= done.frames[-1]:
        scene.frame_set(done.frames[0])
    if scene.rfgs.gaussians.solid_view:
        color_solid_views(context.screen)
    if context.mode == "OBJECT":
        hide_bones(context.screen)
    more = f"; coloured automatically: {done.automatic}" if done.automatic else ""
    return f"Imported {done.count} Gaussians in {len(done.objects)} clouds{more}"


class RFGS_OT_export_gaussians(WithClouds, bpy.types.Operator):
    """Write the selected clouds, or those seen at this frame, as one 3DGS PLY."""

    bl_label = "Export Gaussians"
    bl_options = {"REGISTER"}  # noqa: RUF012
    command = Command(
        "export-gaussians",
        words={"filepath": "out", "objects": "--object"},
        unsaid={"prefer_selected": False},
        frame=True,
    )

    filepath: bpy.props.StringProperty(name="File", description="PLY to write", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(
        name="Filter", description="Which files are listed", default="*.ply", options={"HIDDEN"}
    )

    objects: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Objects",
        description="Names of the clouds, in place of those that are selected or seen",
        options={"SKIP_SAVE"},
    )
    prefer_selected: bpy.props.BoolProperty(
        name="Selected", description="Only the clouds that are selected, if any is", default=True
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[Any]:
        """Asks where to."""
        if not self.filepath:
            self.filepath = f"{chosen_clouds(context)[0].name.replace(' ', '_')}.ply"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Writes the file."""
        path = chosen_path(self.filepath)
        known = {item.name: item for item in clouds_of(context.scene)}
        chosen = [named(known, row.name, "cloud") for row in self.objects]
        chosen = chosen or chosen_clouds(context, selected=self.prefer_selected)
        return f"Wrote {path}: {export_gaussians(context.scene, chosen, path)} Gaussians"


class RFGS_OT_compare_gaussians(WithClouds, bpy.types.Operator):
    """Colour Gaussians by their distance to the true meshes, and report its mean and median."""

    bl_label = "Compare with Mesh"

    every_frame: bpy.props.BoolProperty(
        name="All frames",
        description="Compare the cloud of every frame, not only what is seen now; takes a while",
    )

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Measures and colours."""
        settings, clouds = context.scene.rfgs.gaussians, clouds_of(context.scene)
        selected = [
            item for item in context.selected_objects if item.type == "MESH" and item not in clouds
        ]
        found = compare_with_mesh(
            context.scene,
            clouds,
            settings.display(),
            selected if settings.compare_with == "SELECTED" else None,
            self.every_frame,
            progress,
        )
        settings.color_by = "ERROR"
        keep_result(context.scene, found)
        return found.sentence()
