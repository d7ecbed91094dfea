# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes to the open file that are taken back, so that a panel leaves no trace."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

#: Kinds of rays that Cycles lets objects be invisible to.
RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


class Keeper:
    """Sets attributes and remembers what was there."""

    def __init__(self) -> None:
        self._old: list[tuple[Any, str, Any]] = []
        self._hidden: list[bpy.types.Object] = []

    def remember(self, owner: Any, name: str) -> None:
        """Notes an attribute that others will set; attributes come back last noted first."""
        self._old.append((owner, name, getattr(owner, name)))

    def set(self, owner: Any, name: str, value: Any) -> None:
        """Sets an attribute if it exists and differs; linked data stays as it is."""
        if not hasattr(owner, name):
            return
        old = getattr(owner, name)
        if isinstance(old, bpy.types.bpy_prop_array):
            old = tuple(old)  # Blender hands out a view of what is about to change.
        if old == value:
            return
        try:
            setattr(owner, name, value)
        except AttributeError:  # Data linked from a library cannot be written.
            return
        self._old.append((owner, name, old))

    def make_invisible(self, item: bpy.types.Object) -> None:
        """Hides an object from every ray; whether it renders at all may be keyed or driven."""
        for kind in RAYS:
            self.set(item, f"visible_{kind}", False)

    def unhide(self, item: bpy.types.Object) -> None:
        """Opens the eye of an object in the outliner, which renders do not look at."""
        if item.hide_get():
            item.hide_set(False)
            self._hidden.append(item)

    def restore(self) -> None:
        """Puts everything back, last change first."""
        while self._hidden:
            self._hidden.pop().hide_set(True)
        while self._old:
            owner, name, value = self._old.pop()
            setattr(owner, name, value)


@contextmanager
def kept(scene: bpy.types.Scene) -> Iterator[Keeper]:
    """Yields a `Keeper`; puts attributes, frame and camera back when the block ends."""
    keeper = Keeper()
    frame, camera = scene.frame_current, scene.camera
    try:
        yield keeper
    finally:
        keeper.restore()
        scene.camera = camera
        scene.frame_set(frame)


def free_camera(keeper: Keeper, scene: bpy.types.Scene) -> None:
    """Unbinds cameras from markers, which else take over from the scene's when it is rendered."""
    for marker in scene.timeline_markers:
        keeper.set(marker, "camera", None)


def show_what_renders(keeper: Keeper, scene: bpy.types.Scene) -> None:
    """Makes evaluated meshes equal to the rendered ones.

    Python only reaches the dependency graph of the viewport, so the viewport gets the
    render's visibility, modifiers and subdivision levels.
    """
    for collection in bpy.data.collections:
        keeper.set(collection, "hide_viewport", collection.hide_render)
    for layer in _layer_collections(bpy.context.view_layer.layer_collection):
        keeper.set(layer, "hide_viewport", False)
    for material in bpy.data.materials:
        if material.rfgs.colored:
            keeper.set(material, "diffuse_color", tuple(material.rfgs.own_color))
    keeper.set(scene.render, "simplify_subdivision", scene.render.simplify_subdivision_render)
    for item in bpy.data.objects:
        if not item.hide_render:
            keeper.set(item, "hide_viewport", False)
        keeper.unhide(item)
        keeper.set(item, "show_instancer_for_viewport", item.show_instancer_for_render)
        for modifier in item.modifiers:
            keeper.set(modifier, "show_viewport", modifier.show_render)
            if hasattr(modifier, "render_levels"):
                keeper.set(modifier, "levels", modifier.render_levels)


def _layer_collections(
    root: bpy.types.LayerCollection,
) -> Iterator[bpy.types.LayerCollection]:
    yield root
    for child in root.children:
        yield from _layer_collections(child)
