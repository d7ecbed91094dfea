# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons around ray paths."""

from __future__ import annotations

import bpy
import numpy as np

from ..command import Command
from ..errors import AddonError
from ..ownership import collections_of
from ..reporting import Progress, Undoable, chosen_path
from .curves import COLLECTION, LINK, Selection, chosen, clear_paths, show_paths
from .dataset import open_path_dataset, read_paths, recorded_frames


class RFGS_OT_show_paths(Undoable, bpy.types.Operator):
    """Show the traced paths of a link as curves coloured by power, frame by frame."""

    bl_label = "Show Paths"
    command = Command(
        "paths",
        reads={
            "paths": (
                *("dataset", "radio", "static", "follow", "tx_device", "rx_device"),
                *("count", "range_db", "radius_m"),
            )
        },
        words={"tx_device": "--tx", "rx_device": "--rx"},
        means={"--frame": {"follow": False}},
        instead={"--clear": "clear_paths"},
        frame=True,
        saves=True,
    )

    def work(self, context: bpy.types.Context, progress: Progress) -> str:
        """Reads the path tables with the panel's settings."""
        return show_settings(context.scene, progress)


class RFGS_OT_clear_paths(Undoable, bpy.types.Operator):
    """Remove every ray path from the file."""

    bl_label = "Clear Paths"

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """There are paths."""
        there = bool(collections_of(COLLECTION))
        if not there:
            cls.poll_message_set("No ray paths are shown")
        return there

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Removes objects, curves and materials."""
        _, links = clear_paths()
        return f"Removed the paths of {links} links"


def show_settings(scene: bpy.types.Scene, progress: Progress | None = None) -> str:
    """Shows the paths that the scene's settings ask for.

    Returns:
        What was done, in one line.

    Raises:
        AddonError: There are no such paths; nothing has changed then.
    """
    said = scene.rfgs.paths
    dataset = open_path_dataset(chosen_path(said.dataset or scene.rfgs.jobs.dataset_folder))
    if not dataset.devices:
        raise AddonError(f"{dataset.folder}: holds no radio")
    selection = Selection(
        radio=said.radio or next(iter(dataset.devices)),
        tx_device=said.tx_device,
        rx_device=said.rx_device,
        count=said.count,
        range_db=said.range_db,
        radius_m=said.radius_m,
    )
    frames = [None] if said.static else [scene.frame_current]
    if said.follow and not said.static:
        frames = recorded_frames(dataset, selection.radio)
    tables = chosen(
        {frame: read_paths(dataset, selection.radio, frame) for frame in frames}, selection
    )
    links = {item[LINK] for item in show_paths(scene, dataset, tables, selection, progress)}
    power_db = np.concatenate([paths.power_db for paths in tables.values()])
    more = f" in {len(frames)} frames" if len(frames) > 1 else ""
    return (
        f"{len(power_db)} paths of {len(links)} links of {selection.radio}{more}, "
        f"{power_db.min():.0f} to {power_db.max():.0f} dB"
    )
