# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons about how imported Gaussians are seen."""

import bpy
import numpy as np

from ..errors import AddonError
from ..ownership import own_collection
from ..reporting import Progress
from .attributes import positions
from .clouds import COLLECTION, clouds_of, time_clouds
from .coloring import color_clouds
from .display import see_through, set_display, shown
from .opening import color_view
from .with_clouds import WithClouds

#: Share of the clouds' extent that the crop box leaves free around them.
_MARGIN = 0.02


class RFGS_OT_update_display(WithClouds, bpy.types.Operator):
    """Apply all settings of display, colour and timing to Gaussians that are already here."""

    bl_label = "Update Display"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Writes the panel's settings into every cloud."""
        settings, items = context.scene.rfgs.gaussians, clouds_of(context.scene)
        for item in items:
            set_display(item, settings.display())
        see_through(context.scene, settings.display())
        time_clouds(context.scene, items, settings.frame_offset, settings.interpolation)
        limits = color_clouds([item.data for item in items], settings.coloring())
        ramp = f", colours from {limits[0]:.3g} to {limits[1]:.3g}" if limits else ""
        return f"Updated {len(items)} clouds{ramp}"


class RFGS_OT_color_solid_view(WithClouds, bpy.types.Operator):
    """Make real meshes of the Gaussians and colour them in this Solid view, no other view."""

    bl_label = "Colour in Solid View"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Sets the clouds, and the view the button was pressed in."""
        clouds_of(context.scene)
        context.scene.rfgs.gaussians.solid_view = True
        space = context.space_data
        if space is None or space.type != "VIEW_3D":
            return "Gaussians are real meshes now; no 3D view is open to colour"
        color_view(space)
        return "Gaussians are coloured in this Solid view"


class RFGS_OT_add_crop_box(WithClouds, bpy.types.Operator):
    """Add an Empty around the visible Gaussians and show only what is inside its cube."""

    bl_label = "Add Crop Box"

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Fits the box and crops with it."""
        settings, low, high = context.scene.rfgs.gaussians, [], []
        settings.use_crop = False
        for item in clouds_of(context.scene):
            matrix = np.array(item.matrix_world)
            local = positions(item.data)[shown(item, settings.display())]
            points = local @ matrix[:3, :3].T + matrix[:3, 3]
            if len(points) and not item.hide_viewport:
                low.append(points.min(axis=0))
                high.append(points.max(axis=0))
        if not low:
            raise AddonError("no Gaussian is visible at this frame; lower the thresholds")
        box = crop_to(context.scene, np.min(low, axis=0), np.max(high, axis=0), _MARGIN)
        return f"Cropping to {box.name}; move and scale it"


def crop_to(
    scene: bpy.types.Scene, low: np.ndarray, high: np.ndarray, margin: float = 0.0
) -> bpy.types.Object:
    """Shows only the Gaussians in a box.

    Args:
        scene: Whose Gaussians.
        low: Lower corner [3], in the scene's units.
        high: Upper corner [3].
        margin: Share of its size by which the box is larger.

    Returns:
        The Empty that is the box.
    """
    settings, box = scene.rfgs.gaussians, _own_box(scene)
    box.rotation_euler = (0, 0, 0)
    box.location = 0.5 * (low + high)
    box.scale = np.maximum(0.5 * (high - low) * (1 + margin), 1e-3)
    settings.crop_box, settings.use_crop = box, True
    return box


def _own_box(scene: bpy.types.Scene) -> bpy.types.Object:
    """The box that was added before, to be fitted again; a user's own Empty stays as it is."""
    collection, chosen = own_collection(scene, COLLECTION), scene.rfgs.gaussians.crop_box
    if chosen is not None and chosen.name in collection.objects:
        return chosen
    box = bpy.data.objects.new("RFGS crop box", None)
    box.empty_display_type = "CUBE"
    collection.objects.link(box)
    return box
