# SPDX-License-Identifier: GPL-3.0-or-later
"""How settings that hold a path are declared."""

from typing import Any

import bpy

#: Options of a path that may begin with `//`, the folder of the open file. Since 4.5 Blender
#: wants to be told, and later versions draw the path in red otherwise; earlier ones know no option.
RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def path_setting(name: str, description: str, default: str = "", kind: str = "DIR_PATH") -> Any:
    """A path that may begin with `//`, of a folder or of a file."""
    return bpy.props.StringProperty(
        name=name, description=description, default=default, subtype=kind, options=RELATIVE_PATH
    )
