# SPDX-License-Identifier: GPL-3.0-or-later
"""The one feed that is followed, and the cloud that shows it."""

from __future__ import annotations

import time

import bpy

from ..errors import AddonError
from ..gaussians.cloud_mesh import make_mesh
from ..gaussians.clouds import COLLECTION
from ..gaussians.coloring import Coloring, color_clouds, missing
from ..gaussians.display import add_modifier
from ..gaussians.nodes import GROUP
from ..ownership import own_collection
from ..scene.frames import unit_scale
from .feed import Feed, Update

#: Custom property of the cloud that is moved.
LIVE = "rfgs_live"
_NAME = "Gaussians live"
_EVERY_S = 0.04
#: A script or command waits so long for one update [s].
PATIENCE_S = 30.0


class Following:
    """A connection, and the cloud that its updates move."""

    def __init__(self, scene: bpy.types.Scene, port: int) -> None:
        """Connects, and makes the cloud, in place of an earlier live one.

        Raises:
            AddonError: Nobody sends there, or the scene is linked.
        """
        self._feed = Feed(port)
        try:
            self._cloud = _new_cloud(scene).name
        except AddonError:
            self._feed.close()
            raise
        self.updates, self.left_out, self.count = 0, 0, 0
        self.time_s, self._first_s = 0.0, 0.0

    @property
    def line(self) -> str:
        """What was shown last."""
        # Clocks of radios begin anywhere.
        passed_s = self.time_s - self._first_s
        text = f"{self.count} Gaussians, {self.updates} updates in {passed_s:.1f} s"
        return f"{text}, {self.left_out} left out as no numbers" if self.left_out else text

    def step(self) -> bool:
        """Shows the newest update, if one has arrived.

        Raises:
            AddonError: The feed is over or senseless, or the cloud was removed.
        """
        update = self._feed.newest()
        if update is None:
            return False
        item = bpy.data.objects.get(self._cloud)
        if item is None or LIVE not in item or GROUP not in item.modifiers:
            raise AddonError("the live cloud was removed")
        # Whoever edits the points keeps them until the mode is left.
        if item.mode != "EDIT":
            _show(item, update)
        if not self.updates:
            self._first_s = update.time_s
        self.updates += 1
        self.left_out += update.left_out
        self.count, self.time_s = len(update.cloud), update.time_s
        return True

    def end(self) -> None:
        """Ends the connection; the cloud stays as it is."""
        self._feed.close()


_now: Following | None = None
_said = ""


def following() -> bool:
    """Whether a feed is followed."""
    return _now is not None


def told() -> str:
    """What is shown, or why it ended; empty before anything was followed."""
    return _now.line if _now is not None else _said


def begin(scene: bpy.types.Scene, port: int) -> None:
    """Follows a feed from now on; there must be no other.

    Raises:
        AddonError: It cannot be reached.
    """
    global _now
    _now = Following(scene, port)
    if not bpy.app.timers.is_registered(_tick):
        # Persistent: opening another file is told as the end, not just forgotten.
        bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


def take(scene: bpy.types.Scene, port: int, updates: int) -> str:
    """Follows a feed for some updates, and waits for them.

    Returns:
        What was shown, in one line.

    Raises:
        AddonError: It cannot be reached, ends before, or says nothing for `PATIENCE_S`.
    """
    shown = Following(scene, port)
    try:
        until = time.monotonic() + PATIENCE_S
        while shown.updates < updates:
            if shown.step():
                until = time.monotonic() + PATIENCE_S
            elif time.monotonic() > until:
                raise AddonError(f"no update at TCP port {port} for {PATIENCE_S:.0f} s")
            else:
                time.sleep(0.005)
    finally:
        shown.end()
    return shown.line


def end(why: str = "") -> None:
    """Follows no more; the cloud stays."""
    global _now, _said
    if _now is not None:
        _said = why or f"Stopped: {_now.line}"
        _now.end()
    _now = None
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def _tick() -> float | None:
    if _now is None:
        return None
    try:
        shown = _now.step()
    except AddonError as error:
        end(str(error))
        _draw_again()
        return None
    if shown:
        _draw_again()
    return _EVERY_S


def _draw_again() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _new_cloud(scene: bpy.types.Scene) -> bpy.types.Object:
    collection = own_collection(scene, COLLECTION)
    for item in [item for item in collection.objects if LIVE in item]:
        _take_away(item)
    item = bpy.data.objects.new(_NAME, bpy.data.meshes.new(_NAME))
    item[LIVE] = True
    # Positions are metres; the object's scale carries them into the scene's units.
    item.scale = (1 / unit_scale(scene),) * 3
    item.rfgs.object_class = "IGNORE"
    collection.objects.link(item)
    add_modifier(item, scene.rfgs.gaussians.inspection().display)
    return item


def _show(item: bpy.types.Object, update: Update) -> None:
    mesh = make_mesh(None, update.cloud, {})
    if len(update.cloud):
        scene = item.users_scene[0] if item.users_scene else bpy.context.scene
        coloring = scene.rfgs.gaussians.coloring()
        automatic = coloring.mode == "AUTO" or missing([mesh], coloring)
        color_clouds([mesh], Coloring("POWER") if automatic else coloring)
    before, item.data = item.data, mesh
    if not before.users:
        bpy.data.meshes.remove(before)
    mesh.name = _NAME


def _take_away(item: bpy.types.Object) -> None:
    mesh = item.data
    bpy.data.objects.remove(item)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


def register() -> None:
    """Nothing is followed yet."""


def unregister() -> None:
    """Ends what is followed."""
    end()
