# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around ray paths."""

from __future__ import annotations

import bpy

from ..errors import AddonError
from ..reporting import Progress, Reporting, chosen_path
from .curves import COLLECTION, Choice, chosen, clear_paths, show_paths
from .dataset import open_path_dataset, read_paths


class RFGS_OT_show_paths(Reporting, bpy.types.Operator):
    """Show the traced paths of a link in the current frame as curves coloured by power."""

    bl_idname = "rfgs.show_paths"
    bl_label = "Show Paths"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Reads the path table with the panel's settings."""
        return show_settings(context.scene)


class RFGS_OT_clear_paths(Reporting, bpy.types.Operator):
    """Remove every ray path from the file."""

    bl_idname = "rfgs.clear_paths"
    bl_label = "Clear Paths"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """There are paths."""
        return COLLECTION in bpy.data.collections

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes objects, curves and materials."""
        return f"Removed the paths of {clear_paths()} links"


def show_settings(scene: bpy.types.Scene) -> str:
    """Shows the paths that the scene's settings ask for.

    Returns:
        What was done, in one line.

    Raises:
        AddonError: There are no such paths.
    """
    said = scene.rfgs.paths
    dataset = open_path_dataset(chosen_path(said.dataset or scene.rfgs.jobs.dataset_folder))
    if not dataset.devices:
        raise AddonError(f"{dataset.folder}: holds no radio")
    choice = Choice(
        radio=said.radio or next(iter(dataset.devices)),
        frame=None if said.static else scene.frame_current,
        tx_device=said.tx_device,
        rx_device=said.rx_device,
        count=said.count,
        range_db=said.range_db,
        radius_m=said.radius_m,
    )
    paths = chosen(read_paths(dataset, choice.radio, choice.frame), choice)
    items = show_paths(scene, dataset, paths, choice)
    weakest, strongest = paths.power_db[-1], paths.power_db[0]
    return (
        f"{len(paths)} paths of {len(items)} links of {choice.radio}, "
        f"{weakest:.0f} to {strongest:.0f} dB"
    )
