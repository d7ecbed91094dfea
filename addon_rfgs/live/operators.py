# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons that follow a feed and stop doing so."""

from __future__ import annotations

import bpy

from ..command import Command
from ..gaussians.opening import color_solid_views
from ..reporting import Progress, Reporting, Undoable
from .following import begin, end, following, take, told


class RFGS_OT_follow_live(Undoable, bpy.types.Operator):
    """Show the Gaussians that rfgs live sends, as a cloud that moves while radios send."""

    bl_label = "Follow Live"
    command = Command("live", reads={"live": ("port",)}, unsaid={"updates": 1}, saves=True)

    updates: bpy.props.IntProperty(
        name="Updates",
        description="Wait for so many updates and stop; 0: go on until Stop Live. Without a "
        "window, 1 at least",
        min=0,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """One at a time."""
        if following():
            cls.poll_message_set("A feed is followed already; press Stop Live first")
        return not following()

    def work(self, context: bpy.types.Context, _progress: Progress) -> str:
        """Connects; waits for updates only where that is asked for."""
        port = context.scene.rfgs.live.port
        # Timers need a window.
        count = max(self.updates, 1) if bpy.app.background else self.updates
        if count:
            said = take(context.scene, port, count)
        else:
            begin(context.scene, port)
            said = f"Follows 127.0.0.1, TCP port {port}"
        if context.scene.rfgs.gaussians.solid_view:
            color_solid_views(context.screen)
        return said


class RFGS_OT_stop_live(Reporting, bpy.types.Operator):
    """Stop following rfgs live; the cloud stays as it was shown last."""

    bl_label = "Stop Live"

    @classmethod
    def ready(cls, _context: bpy.types.Context) -> bool:
        """A feed is followed."""
        if not following():
            cls.poll_message_set("Nothing is followed")
        return following()

    def work(self, _context: bpy.types.Context, _progress: Progress) -> str:
        """Ends the connection."""
        end()
        return told()
