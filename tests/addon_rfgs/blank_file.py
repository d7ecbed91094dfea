# SPDX-License-Identifier: Apache-2.0
"""An empty file for the next test inside Blender."""

from __future__ import annotations

import bpy


def open_blank_file() -> None:
    """A scene without anything, with Blender's own settings of files.

    Preferences stay: to read those of the factory too, `read_factory_settings` loads every add-on
    of Blender anew, which takes six times as long.
    """
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
