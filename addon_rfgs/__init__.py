# SPDX-License-Identifier: GPL-3.0-or-later
"""RF-GS inside Blender: radio properties, scene bundles, ground truth, Gaussians.

Works as an extension of Blender 4.2 and newer and as a package beside pip `bpy`.
"""

import atexit

import bpy

from . import command, properties, registration
from .channels import waiting
from .check import aging
from .devices import overlay
from .gaussians import file_menu, legend, opening
from .jobs import following
from .live import following as live_following

_MODULES = (
    *(registration, properties, overlay, command, following, waiting, aging, file_menu),
    *(legend, opening, live_following),
)


def register() -> None:
    """Registers everything; called by Blender when the extension is enabled."""
    for module in _MODULES:
        module.register()
    if getattr(bpy.app, "module", not bpy.app.binary_path):  # Blender 4.2 has no `module` yet.
        # Blender as a Python module crashes or hangs at exit on classes still registered.
        atexit.register(unregister)


def unregister() -> None:
    """Takes back everything that `register` added."""
    atexit.unregister(unregister)
    for module in reversed(_MODULES):
        module.unregister()
