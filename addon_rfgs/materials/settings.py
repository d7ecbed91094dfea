# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the materials panel."""

import bpy


class RFGS_PG_materials(bpy.types.PropertyGroup):
    """What materials are checked against."""

    carrier_ghz: bpy.props.FloatProperty(
        name="Carrier [GHz]",
        description="Frequency at which materials must be known; 0: the bands of the scene's "
        "radio devices",
        min=0.0,
        max=100.0,
        precision=3,
    )
