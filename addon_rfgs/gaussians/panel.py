# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels that bring Gaussians back into the scene and inspect them."""

import bpy

from ..steps import PartOfStep, Step
from .cloud_mesh import FRAME
from .clouds import clouds_here, path_or_run
from .coloring import RAMPED, missing
from .compare import kept_result
from .nodes import NO_POWER_DB


class RFGS_PT_gaussians(Step, bpy.types.Panel):
    """Gaussians back into the scene."""

    bl_label = "5 Inspect"
    step, icon = "inspect", "OUTLINER_OB_POINTCLOUD"

    @classmethod
    def waits_for(cls, scene: bpy.types.Scene) -> str:
        """Gaussians, in the scene or on disk."""
        return "" if clouds_here(scene) or path_or_run(scene) else "no Gaussians"

    @classmethod
    def taken(cls, scene: bpy.types.Scene) -> str:
        """How many clouds there are."""
        count = len(clouds_here(scene))
        return f"{count} cloud{'' if count == 1 else 's'}" if count else ""

    def draw_step(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Shows the path and the buttons."""
        layout, settings = self.columns(layout), context.scene.rfgs.gaussians
        trained = path_or_run(context.scene) and not settings.path
        layout.prop(settings, "path", placeholder="the run of step 4" if trained else "")
        layout.operator("rfgs.import_gaussians", icon="IMPORT")
        layout.operator("rfgs.export_gaussians", icon="EXPORT")
        overlay = getattr(context.space_data, "overlay", None)
        if overlay is not None and clouds_here(context.scene):
            layout.prop(overlay, "show_bones", text="Show bones")
        item = context.object
        if item is not None and item.type == "MESH" and FRAME in item.data:
            layout.label(text=f"{item.name}: recorded at frame {item.data[FRAME]}", icon="INFO")


class _Part(PartOfStep):
    """A panel below the one above."""

    bl_parent_id = "RFGS_PT_gaussians"
    names: tuple[str, ...] = ()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there are Gaussians that it acts on."""
        return bool(clouds_here(context.scene)) and super().poll(context)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the settings `names`."""
        layout = self.columns()
        for name in self.names:
            layout.prop(context.scene.rfgs.gaussians, name)


class RFGS_PT_gaussians_display(_Part, bpy.types.Panel):
    """How Gaussians are shown; acts at once."""

    bl_label = "Display"
    bl_options = set()  # noqa: RUF012
    names = ("display_mode", "size", "opacity_threshold")

    def draw(self, context: bpy.types.Context) -> None:
        """Shows shapes and thresholds."""
        super().draw(context)
        layout, settings = self.columns(), context.scene.rfgs.gaussians
        self.automatic(layout, settings, "power_threshold_db", "all of them", NO_POWER_DB)
        layout.prop(settings, "solid_view")
        self.layout.operator("rfgs.color_solid_view", icon="SHADING_SOLID")
        self.layout.operator("rfgs.update_display", icon="FILE_REFRESH")


class RFGS_PT_gaussians_color(_Part, bpy.types.Panel):
    """What the colour of Gaussians says."""

    bl_label = "Colour"
    bl_options = set()  # noqa: RUF012
    names = ("color_by",)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the mode, and the range where it has one."""
        super().draw(context)
        settings = context.scene.rfgs.gaussians
        self.layout.prop(settings, "legend")
        if settings.color_by == "ATTRIBUTE":
            self.layout.prop(settings, "color_attribute")
        clouds = [item.data for item in clouds_here(context.scene)]
        lacking = missing(clouds, settings.coloring())
        if lacking and clouds:
            self.layout.label(text=f"No cloud has {lacking}", icon="ERROR")
        if settings.color_by in {*RAMPED, "ATTRIBUTE", "AUTO"}:
            self.layout.prop(settings, "use_range")
            if settings.use_range:
                self.layout.prop(settings, "range_low")
                self.layout.prop(settings, "range_high")


class RFGS_PT_gaussians_crop(_Part, bpy.types.Panel):
    """Only the Gaussians inside a box."""

    bl_label = "Crop"
    names = ("crop_box",)

    def draw_header(self, context: bpy.types.Context) -> None:
        """Switches cropping."""
        self.layout.prop(context.scene.rfgs.gaussians, "use_crop", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the box."""
        super().draw(context)
        self.layout.operator("rfgs.add_crop_box", icon="CUBE")


class RFGS_PT_gaussians_timing(_Part, bpy.types.Panel):
    """When each cloud is seen."""

    bl_label = "Timeline"
    names = ("frame_offset", "interpolation")


class RFGS_PT_gaussians_compare(_Part, bpy.types.Panel):
    """How far Gaussians are from the true surface."""

    bl_label = "Compare with Mesh"
    bl_options = set()  # noqa: RUF012
    names = ("compare_with",)

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the choice of meshes and the buttons."""
        super().draw(context)
        row = self.layout.row(align=True)
        row.operator("rfgs.compare_gaussians", text="This Frame", icon="SNAP_NORMAL")
        row.operator("rfgs.compare_gaussians", text="All Frames").every_frame = True
        for number, line in enumerate(kept_result(context.scene)):
            self.layout.label(text=line, icon="BLANK1" if number else "INFO")
