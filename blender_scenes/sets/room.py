# SPDX-License-Identifier: GPL-3.0-or-later
"""A room without people: its shell, its furniture and its light."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from blender_scenes.assemble import Folders
from blender_scenes.sets.shell import Shell, build_shell
from blender_scenes.shapes import Builder


@dataclass(frozen=True)
class Room:
    """What `build` puts into a scene's folders."""

    shell: Shell
    furnish: Callable[[bpy.types.Collection], None]
    """Puts the furniture into a collection."""
    light: Callable[[bpy.types.Collection], None]
    """Puts the lamps into a collection."""

    def build(self, folders: Folders) -> None:
        """Builds everything into the folders Room, Furniture and Stage."""
        build_shell(self.shell, folders["Room"])
        self.furnish(folders["Furniture"])
        self.light(folders["Stage"])


def put(
    collection: bpy.types.Collection,
    piece: Builder,
    x: float,
    y: float,
    degrees: float = 0.0,
    z: float = 0.0,
) -> None:
    """Builds `piece` at x, y, z [m], turned by `degrees` about the vertical."""
    piece.build(collection, location=(x, y, z), yaw=math.radians(degrees))
