# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the ray path panel."""

import bpy

from ..path_options import RELATIVE_PATH


class RFGS_PG_paths(bpy.types.PropertyGroup):
    """Which paths are shown."""

    dataset: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Dataset",
        description="Dataset that was generated with ray paths; empty: the one of Generate and "
        "Train",
        default="",
        subtype="DIR_PATH",
        options=RELATIVE_PATH,
    )
    radio: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Radio", description="Radio of the dataset; empty: its first", default=""
    )
    follow: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Follow timeline",
        description="Show the paths of every recorded frame, each until the next one; otherwise "
        "those of the current frame alone, at all times",
        default=True,
    )
    static: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Without people",
        description="Paths of the scene without anything that moves, in place of those of frames",
        default=False,
    )
    tx_device: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="From device",
        description="Transmitting device, counted from 0; -1: all",
        default=-1,
        min=-1,
    )
    rx_device: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="To device",
        description="Receiving device, counted from 0; -1: all",
        default=-1,
        min=-1,
    )
    count: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Strongest",
        description="At most so many paths of each link and frame",
        default=200,
        min=1,
        max=20000,
    )
    range_db: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Range",
        description="Leave out paths weaker than the strongest by more than this [dB]",
        default=60.0,
        min=0.0,
        soft_max=120.0,
    )
    radius_m: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Radius",
        # No unit subtype: Blender would take it for its own units, which need not be metres.
        description="Thickness of the curves [m]",
        default=0.004,
        min=0.0,
        soft_max=0.1,
        precision=4,
    )
