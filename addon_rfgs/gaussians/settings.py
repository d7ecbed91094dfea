# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the Gaussians panels; those of display and timing act at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..errors import AddonError
from ..path_options import path_setting
from .clouds import Inspection, clouds_here, time_clouds
from .coloring import Coloring, color_clouds
from .display import Display, see_through, set_display
from .nodes import NO_POWER_DB

DISPLAY_MODES = [
    ("points", "Points", "One sphere of equal size per Gaussian; fast", 0),
    ("ellipsoids", "Ellipsoids", "One ellipsoid per Gaussian at one standard deviation", 1),
    (
        "splats",
        "Splats",
        "As 3DGS draws them, for Material Preview and renders: opacity falls off",
        2,
    ),
]

INTERPOLATIONS = [
    ("NONE", "None", "A cloud is seen at its own frame alone", 0),
    ("NEAREST", "Nearest", "Between recorded frames, the nearest one is seen", 1),
    ("HOLD", "Hold", "A cloud is seen until the next recorded frame", 2),
]

COLOR_MODES = [
    (
        "AUTO",
        "Automatic",
        "Reflected power where it spans 3 dB, else display colours, else features",
        0,
    ),
    ("DISPLAY", "Display RGB", "Colours fitted to pictures, for display alone", 1),
    ("POWER", "Reflected power", "Power that each Gaussian reflects [dB]", 2),
    ("PHASE", "Phase", "Phase of the reflectivity on a circle of hues", 3),
    ("FEATURES", "Features", "First three principal components of the radio features", 4),
    ("ERROR", "Distance to mesh", "Distance to the true surface, after Compare with Mesh", 5),
    ("TRACK", "Track", "One hue for each Gaussian that is followed from frame to frame", 6),
    ("ATTRIBUTE", "Attribute", "Any number of the PLY or of the points, by name", 7),
]

TRUE_MESHES = [
    ("MOVING", "What moves", "Every visible mesh that moves within the scene's frames", 0),
    ("SELECTED", "Selected", "The selected meshes", 1),
]


def _show(settings: RFGS_PG_gaussians, _context: Any) -> None:
    clouds = clouds_here(settings.id_data)
    for item in clouds:
        set_display(item, settings.display())
    if clouds:
        see_through(settings.id_data, settings.display())


def _color(settings: RFGS_PG_gaussians, _context: Any) -> None:
    _recolor(settings, settings.coloring())


def _fix_range(settings: RFGS_PG_gaussians, context: Any) -> None:
    """A range that was never given starts as the one that was found."""
    if settings.use_range and not settings.is_property_set("range_low"):
        limits = _recolor(settings, replace(settings.coloring(), limits=None))
        if limits:
            settings.range_low, settings.range_high = limits
    _color(settings, context)


def _time(settings: RFGS_PG_gaussians, _context: Any) -> None:
    scene = settings.id_data
    time_clouds(scene, clouds_here(scene), settings.frame_offset, settings.interpolation)


def _recolor(settings: RFGS_PG_gaussians, coloring: Coloring) -> tuple[float, float] | None:
    """Colours the clouds that are here; returns the ends of the ramp, if there is one.

    Colours that clouds cannot have are named in the panel.
    """
    try:
        return color_clouds([item.data for item in clouds_here(settings.id_data)], coloring)
    except AddonError:
        return None


def _redraw(_settings: RFGS_PG_gaussians, context: Any) -> None:
    for area in context.screen.areas if context.screen else []:
        area.tag_redraw()


def _is_empty(_settings: Any, item: bpy.types.Object) -> bool:
    return item.type == "EMPTY"


class RFGS_PG_gaussians(bpy.types.PropertyGroup):
    """Which Gaussians are shown, and how."""

    path: path_setting(
        "Gaussians", "A run folder, its gaussians folder or one 3DGS PLY", kind="FILE_PATH"
    )
    display_mode: bpy.props.EnumProperty(
        name="Show as",
        description="What stands for a Gaussian",
        items=DISPLAY_MODES,
        default="points",
        update=_show,
    )
    opacity_threshold: bpy.props.FloatProperty(
        name="Min opacity",
        description="Gaussians below this opacity are hidden",
        default=0.005,
        min=0.0,
        max=1.0,
        precision=3,
        subtype="FACTOR",
        update=_show,
    )
    power_threshold_db: bpy.props.FloatProperty(
        name="Min power [dB]",
        description="Gaussians known to reflect less power [dB] are hidden",
        default=NO_POWER_DB,
        min=NO_POWER_DB,
        max=300.0,
        soft_min=-100.0,
        soft_max=100.0,
        precision=1,
        update=_show,
    )
    size: bpy.props.FloatProperty(
        name="Size",
        description="Size of points, or how many standard deviations ellipsoids reach",
        default=1.0,
        min=0.0,
        max=100.0,
        soft_max=5.0,
        update=_show,
    )
    solid_view: bpy.props.BoolProperty(
        name="Real meshes",
        description="Make real meshes of the Gaussians, which the Solid view can colour; off: "
        "points or instances, which play faster and are white in the Solid view",
        default=True,
        update=_show,
    )
    use_crop: bpy.props.BoolProperty(
        name="Crop", description="Hide Gaussians outside the crop box", update=_show
    )
    crop_box: bpy.props.PointerProperty(
        name="Box",
        description="Empty whose cube of half edge one, turned and scaled with it, is the box",
        type=bpy.types.Object,
        poll=_is_empty,
        update=_show,
    )
    color_by: bpy.props.EnumProperty(
        name="Colour by",
        description="What the colour of a Gaussian says",
        items=COLOR_MODES,
        default="AUTO",
        update=_color,
    )
    color_attribute: bpy.props.StringProperty(
        name="Attribute",
        description="Name of a property of the PLY, or of an attribute of the points",
        update=_color,
    )
    use_range: bpy.props.BoolProperty(
        name="Fixed range",
        description="Give the ends of the colour ramp instead of finding them from the values",
        update=_fix_range,
    )
    range_low: bpy.props.FloatProperty(
        name="From",
        description="Value of the first colour: dB for power, metres for distance",
        default=-20.0,
        update=_color,
    )
    range_high: bpy.props.FloatProperty(
        name="To",
        description="Value of the last colour: dB for power, metres for distance",
        default=20.0,
        update=_color,
    )
    frame_offset: bpy.props.IntProperty(
        name="Frame offset",
        description="The cloud of frame f is shown at frame f + offset",
        min=-500_000,
        max=500_000,
        update=_time,
    )
    interpolation: bpy.props.EnumProperty(
        name="Between frames",
        description="What is seen between recorded frames",
        items=INTERPOLATIONS,
        default="HOLD",
        update=_time,
    )
    legend: bpy.props.BoolProperty(
        name="Legend",
        description="Draw in the 3D view what the colours of Gaussians mean",
        default=True,
        update=_redraw,
    )
    compare_with: bpy.props.EnumProperty(
        name="True mesh",
        description="Surfaces that Gaussians are compared with",
        items=TRUE_MESHES,
        default="MOVING",
    )

    def display(self) -> Display:
        """How the panel says Gaussians are shown."""
        return Display(
            self.display_mode,
            self.opacity_threshold,
            self.power_threshold_db,
            self.size,
            self.solid_view,
            self.crop_box if self.use_crop else None,
        )

    def coloring(self) -> Coloring:
        """What the panel says Gaussians are coloured by."""
        limits = (self.range_low, self.range_high) if self.use_range else None
        return Coloring(self.color_by, limits, self.color_attribute)

    def inspection(self) -> Inspection:
        """All that the panel says about an import."""
        return Inspection(self.display(), self.coloring(), self.frame_offset, self.interpolation)
