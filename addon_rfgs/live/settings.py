# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the live panel."""

import bpy


class RFGS_PG_live(bpy.types.PropertyGroup):
    """Where updates come from."""

    port: bpy.props.IntProperty(
        name="Feed port",
        description="TCP port of this machine at which rfgs live sends updates (--feed-port)",
        default=8765,
        min=1,
        max=65535,
    )
