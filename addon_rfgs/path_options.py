# SPDX-License-Identifier: GPL-3.0-or-later
"""How properties that hold a path are declared."""

import bpy

#: Options of a path that may begin with `//`, the folder of the open file. Since 4.5 Blender
#: wants to be told, and later versions draw the path in red otherwise; earlier ones know no option.
RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()
