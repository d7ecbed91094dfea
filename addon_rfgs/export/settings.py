# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the dataset panel."""

import bpy

from ..path_options import path_setting
from ..scene_choice import SceneChoice


class RFGS_PG_export(SceneChoice, bpy.types.PropertyGroup):
    """What is exported and rendered, and where to."""

    cameras: bpy.props.IntProperty(
        name="Cameras", description="First N cameras by name; 0: all", min=0
    )
    resolution: bpy.props.IntProperty(
        name="Resolution",
        description="Longer side of the pictures [px]; 0: the scene's own",
        min=0,
        subtype="PIXEL",
    )
    bundle_folder: path_setting("Bundle", "Folder the scene bundle is written to", "//rfgs_bundle")
    spans: bpy.props.StringProperty(
        name="Spans",
        description="Also write poses over so long after each frame [s], several with commas "
        "between; 0: until the next",
    )
    velocities: bpy.props.BoolProperty(
        name="Velocities", description="Also write that of every vertex"
    )
    pictures_folder: path_setting(
        "Pictures", "Folder the ground truth is written to", "//rfgs_pictures"
    )
    samples: bpy.props.IntProperty(
        name="Samples", description="Cycles samples per pixel", default=16, min=1
    )
    passes: bpy.props.BoolProperty(
        name="Passes",
        description="Also write depth, normals and masks: a multilayer EXR per picture",
        default=True,
    )
    empty: bpy.props.BoolProperty(
        name="Empty", description="Hide all that moves, and render once per camera"
    )
