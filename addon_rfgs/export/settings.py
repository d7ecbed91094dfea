# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the dataset panel."""

import bpy

from ..path_options import RELATIVE_PATH


class RFGS_PG_export(bpy.types.PropertyGroup):
    """What is exported and rendered, and where to."""

    frames: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Frames",
        description="First:last or first:last:step, both ends included; empty: the whole range",
        default="",
    )
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
