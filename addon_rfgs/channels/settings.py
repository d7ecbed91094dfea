# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the channel panel."""

import bpy

from ..path_options import RELATIVE_PATH


class RFGS_PG_channels(bpy.types.PropertyGroup):
    """Which link is drawn."""

    run_folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Run",
        description="Folder of a training; empty: the one whose Gaussians are imported",
        default="",
        subtype="DIR_PATH",
        options=RELATIVE_PATH,
    )
    tx_device: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="From device",
        description="Transmitting device, counted from 0",
        default=0,
        min=0,
    )
    rx_device: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="To device",
        description="Receiving device, counted from 0; -1: the first that hears the transmitter",
        default=-1,
        min=-1,
    )
