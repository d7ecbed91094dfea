# SPDX-License-Identifier: GPL-3.0-or-later
"""The RF-GS tab of the 3D view's sidebar, where every panel stands."""


class Tab:
    """Mixed into each panel."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RF-GS"
