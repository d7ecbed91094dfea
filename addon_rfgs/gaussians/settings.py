# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the Gaussians panel."""

import bpy

DISPLAY_MODES = [
    ("points", "Points", "One sphere of equal size per Gaussian; fast", 0),
    ("ellipsoids", "Ellipsoids", "One ellipsoid per Gaussian at one standard deviation", 1),
]


class RFGS_PG_gaussians(bpy.types.PropertyGroup):
    """Which Gaussians are shown, and how."""

    path: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Gaussians",
        description="A run folder, its gaussians folder or one 3DGS PLY",
        default="",
        subtype="FILE_PATH",
    )
    display_mode: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Show as", items=DISPLAY_MODES, default="points"
    )
    opacity_threshold: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Opacity threshold",
        description="Gaussians below this opacity are hidden",
        default=0.005,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
