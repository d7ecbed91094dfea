# SPDX-License-Identifier: Apache-2.0
"""Builds a furnished room without radio devices, and exports it; runs in its own Python.

Usage: build_devices.py FOLDER. Writes FOLDER/bare.blend and FOLDER/bare/, its bundle, and
FOLDER/<preset>/, the bundle of the same room with the devices of a preset placed in it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
from build_scenes import box, room

import addon_rfgs
from addon_rfgs.export.bundle import export_bundle

#: One for each rule of placement.
PRESETS = ("wifi", "uwb", "sar")


def main(folder: Path) -> None:
    """Builds and exports."""
    addon_rfgs.register()
    room()
    bpy.data.objects.remove(bpy.data.objects["ap"])
    bpy.data.objects["floor"].scale = (1.25, 1.0, 1.0)
    box("cupboard", (-2.5, -2.0, 0.0), (-1.9, -1.4, 2.0), "oak")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "bare.blend"))
    export_bundle(bpy.context.scene, folder / "bare", "1:1")
    for name in PRESETS:
        assert bpy.ops.rfgs.place_radio(radio=name) == {"FINISHED"}
        export_bundle(bpy.context.scene, folder / name, "1:1")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
