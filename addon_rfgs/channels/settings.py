# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the channel panel."""

import bpy

from ..path_options import path_setting


class RFGS_PG_channels(bpy.types.PropertyGroup):
    """Which link is drawn."""

    run_folder: path_setting(
        "Run", "Folder of a training; empty: the one whose Gaussians are imported"
    )
    tx_device: bpy.props.IntProperty(
        name="From device", description="Transmitting device, counted from 0", min=0
    )
    rx_device: bpy.props.IntProperty(
        name="To device",
        description="Receiving device, counted from 0; -1: the first that hears the transmitter",
        default=-1,
        min=-1,
    )
