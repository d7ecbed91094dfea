# SPDX-License-Identifier: GPL-3.0-or-later
"""The RF-GS tab of the 3D view's sidebar."""

import bpy

from .tables import MATERIALS


class _Tab:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RF-GS"


class RFGS_PT_object(_Tab, bpy.types.Panel):
    """Radio meaning of the active object and its material."""

    bl_idname = "RFGS_PT_object"
    bl_label = "Radio"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows what applies to the type of the active object."""
        layout, item = self.layout, context.object
        layout.use_property_split = True
        layout.use_property_decorate = False
        if item is None:
            layout.label(text="No active object", icon="INFO")
            return
        if item.type == "EMPTY":
            layout.prop(item.rfgs, "role")
            if item.rfgs.role != "NONE":
                layout.prop(item.rfgs, "radio")
                if item.rfgs.radio in {"any", "scene"}:
                    box = layout.box()
                    box.label(text="Radio 'scene'")
                    for name in item.rfgs.rf.bl_rna.properties.keys()[2:]:
                        box.prop(item.rfgs.rf, name)
        if item.type in {"MESH", "CURVE", "SURFACE", "FONT", "META", "EMPTY"}:
            layout.prop(item.rfgs, "object_class")
            layout.prop(item.rfgs, "instance")
            layout.prop(item.rfgs, "surface_m2")
        material = item.active_material
        if material is not None:
            box = layout.box()
            box.label(text=material.name, icon="MATERIAL")
            box.prop(material.rfgs, "radio_material")
            box.prop(material.rfgs, "thickness_m")
            if material.rfgs.thickness_m == 0 and material.rfgs.radio_material in MATERIALS:
                thickness_m = MATERIALS[material.rfgs.radio_material]["thickness_m"]
                box.label(text=f"{thickness_m:g} m, the material's own")
            box.prop(material.rfgs, "scattering_coefficient")


class RFGS_PT_dataset(_Tab, bpy.types.Panel):
    """Bundle and ground truth."""

    bl_idname = "RFGS_PT_dataset"
    bl_label = "Dataset"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows settings and the two buttons."""
        layout, settings = self.layout, context.scene.rfgs
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "frames")
        layout.prop(settings, "cameras")
        layout.prop(settings, "resolution")
        layout.prop(settings, "bundle_folder")
        layout.operator("rfgs.export_bundle", icon="EXPORT")
        layout.prop(settings, "pictures_folder")
        layout.prop(settings, "samples")
        layout.prop(settings, "passes")
        layout.operator("rfgs.render_groundtruth", icon="RENDER_STILL")


class RFGS_PT_gaussians(_Tab, bpy.types.Panel):
    """Gaussians back into the scene."""

    bl_idname = "RFGS_PT_gaussians"
    bl_label = "Gaussians"

    def draw(self, context: bpy.types.Context) -> None:
        """Shows the path, display settings and buttons."""
        layout, settings = self.layout, context.scene.rfgs
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "gaussians_path")
        layout.operator("rfgs.import_gaussians", icon="IMPORT")
        layout.prop(settings, "display_mode")
        layout.prop(settings, "opacity_threshold")
        layout.operator("rfgs.update_display", icon="FILE_REFRESH")


PANELS = (RFGS_PT_object, RFGS_PT_dataset, RFGS_PT_gaussians)


def register() -> None:
    """Adds the panels."""
    for cls in PANELS:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the panels."""
    for cls in reversed(PANELS):
        bpy.utils.unregister_class(cls)
