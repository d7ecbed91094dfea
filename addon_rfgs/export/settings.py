# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the dataset panel."""

import bpy

from ..path_options import RELATIVE_PATH
from ..scene_choice import SceneChoice


class RFGS_PG_export(SceneChoice, bpy.types.PropertyGroup):
    """What is exported and rendered, and where to."""

    cameras: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Cameras", description="First N cameras by name; 0: all", default=0, min=0
    )
    resolution: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Resolution",
        description="Longer side of the pictures [px]; 0: the scene's own",
        default=0,
        min=0,
        subtype="PIXEL",
    )
    bundle_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Bundle",
        description="Folder the scene bundle is written to",
        default="//rfgs_bundle",
        subtype="DIR_PATH",
        options=RELATIVE_PATH,
    )
    spans: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Spans",
        description="Also write poses over so long after each frame [s], several with commas "
        "between; 0: until the next",
        default="",
    )
    velocities: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Velocities", description="Also write that of every vertex", default=False
    )
    pictures_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Pictures",
        description="Folder the ground truth is written to",
        default="//rfgs_pictures",
        subtype="DIR_PATH",
        options=RELATIVE_PATH,
    )
    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", description="Cycles samples per pixel", default=16, min=1
    )
    passes: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Depth, normals, masks",
        description="Also write a multilayer EXR per picture",
        default=True,
    )
    empty: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Empty",
        description="Hide all that moves, and render once per camera",
        default=False,
    )
