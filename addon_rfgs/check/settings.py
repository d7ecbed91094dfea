# SPDX-License-Identifier: GPL-3.0-or-later
"""The findings of the last scene check; they are not saved in the file."""

from __future__ import annotations

import bpy

from ..scene.findings import SEVERITIES, Finding


class RFGS_PG_finding(bpy.types.PropertyGroup):
    """One thing that a user should know about the scene."""

    severity: bpy.props.EnumProperty(
        name="Severity",
        description="How bad it is",
        items=[(name.upper(), name.capitalize(), "") for name in SEVERITIES],
    )
    object: bpy.props.StringProperty(name="Object", description="What it is about")
    message: bpy.props.StringProperty(name="Finding", description="What was found")
    remedy: bpy.props.StringProperty(name="Remedy", description="What to do about it")
    kind: bpy.props.StringProperty(name="Kind", description="Which kind of finding it is")
    material: bpy.props.StringProperty(name="Material", description="The material it is about")
    repairable: bpy.props.BoolProperty(
        name="Repairable", description="Whether there is a safe repair"
    )

    def finding(self) -> Finding:
        """The same as plain data."""
        texts = (self.object, self.message, self.remedy, self.kind, self.material)
        return Finding(self.severity.lower(), *texts)


class RFGS_PG_check(bpy.types.PropertyGroup):
    """The last scene check."""

    rows: bpy.props.CollectionProperty(
        type=RFGS_PG_finding, name="Findings", description="What was found, the worst first"
    )
    active: bpy.props.IntProperty(name="Finding", description="The active row of the list", min=0)
    summary: bpy.props.StringProperty(
        name="Summary", description="How many findings of each kind there are"
    )
    outdated: bpy.props.BoolProperty(
        name="Out of Date", description="Whether Undo or Redo changed the scene since the check"
    )
