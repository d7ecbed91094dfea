# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the coverage panel."""

import bpy

from ..path_options import path_setting


class RFGS_PG_coverage(bpy.types.PropertyGroup):
    """Which map is shown."""

    path: path_setting(
        "Map", "File that `rfgs-factory coverage` wrote", "//coverage.json", kind="FILE_PATH"
    )
    tx_device: bpy.props.IntProperty(
        name="From device",
        description="Transmitter of the map, counted from 0; -1: the loudest one everywhere",
        default=-1,
        min=-1,
    )
