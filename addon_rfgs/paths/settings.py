# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the ray path panel."""

import bpy

from ..path_options import path_setting


class RFGS_PG_paths(bpy.types.PropertyGroup):
    """Which paths are shown."""

    dataset: path_setting(
        "Dataset",
        "Dataset that was generated with ray paths; empty: the one of Generate and Train",
    )
    radio: bpy.props.StringProperty(
        name="Radio", description="Radio of the dataset; empty: its first"
    )
    follow: bpy.props.BoolProperty(
        name="Follow timeline",
        description="Show the paths of every recorded frame, each until the next one; otherwise "
        "those of the current frame alone, at all times",
        default=True,
    )
    static: bpy.props.BoolProperty(
        name="Without people",
        description="Paths of the scene without anything that moves, in place of those of frames",
    )
    tx_device: bpy.props.IntProperty(
        name="From device",
        description="Transmitting device, counted from 0; -1: all",
        default=-1,
        min=-1,
    )
    rx_device: bpy.props.IntProperty(
        name="To device",
        description="Receiving device, counted from 0; -1: all",
        default=-1,
        min=-1,
    )
    count: bpy.props.IntProperty(
        name="Strongest",
        description="At most so many paths of each link and frame",
        default=200,
        min=1,
        max=20000,
    )
    range_db: bpy.props.FloatProperty(
        name="Range [dB]",
        description="Leave out paths weaker than the strongest by more than this [dB]",
        default=60.0,
        min=0.0,
        soft_max=120.0,
    )
    radius_m: bpy.props.FloatProperty(
        name="Radius [m]",
        # No unit subtype: Blender would take it for its own units, which need not be metres.
        description="Thickness of the curves [m]",
        default=0.004,
        min=0.0,
        soft_max=0.1,
        precision=4,
    )
