# SPDX-License-Identifier: GPL-3.0-or-later
"""A file that shows its Gaussians as soon as it is opened, and where to go on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..ownership import found_collection, own_collection
from ..scene.outlines import take_from_renders
from .clouds import COLLECTION, Imported
from .display import Display
from .viewpoint import choose_camera, shown_points, sight_lines

#: Whether the tab of this add-on is opened with the file; kept on the collection of the clouds.
_OPENS = "rfgs_opens_tab"
#: What hides more than this share of the Gaussians is hidden itself.
_IN_THE_WAY = 0.05
#: No more than so many things are taken away, one behind the other.
_MOST_HIDDEN = 12
#: Faces whose edges stand for a true mesh.
_TRUTH_FACES = 240
#: Colour of the true mesh's lines.
_TRUTH = (0.5, 0.42, 0.36, 1.0)
#: The sidebar is there once it was drawn: so often and after so long it is asked [s].
_TRIES, _PAUSE_S = 40, 0.25


def show_at_opening(
    scene: bpy.types.Scene,
    imported: Imported,
    display: Display,
    moving: Sequence[bpy.types.Object],
    wanted: str | None = None,
) -> bpy.types.Object:
    """Prepares the open file, which is to be saved: its views look at the Gaussians in colour.

    Args:
        scene: The scene that is seen.
        imported: The Gaussians.
        display: How they are shown.
        moving: The true meshes, which become thin lines.
        wanted: Name of the camera to look through; None chooses one.

    Returns:
        The camera.
    """
    camera = choose_camera(scene, imported, display, wanted)
    scene.camera = camera
    for item in moving:
        _outline(item)
    _clear_the_way(scene, camera, shown_points(imported, display), moving)
    for space in _views():
        color_view(space)
        space.shading.wireframe_color_type = "OBJECT"
        space.use_local_camera = False
        space.region_3d.view_perspective = "CAMERA"
    own_collection(scene, COLLECTION)[_OPENS] = True
    return camera


def _outline(item: bpy.types.Object) -> None:
    """Draws a true mesh as few thin lines, and lets renders show the Gaussians alone."""
    take_from_renders(item)
    item.display_type, item.color = "WIRE", _TRUTH
    if item.type == "MESH" and len(item.data.polygons) > _TRUTH_FACES:
        fewer: Any = item.modifiers.new("RFGS outline", "DECIMATE")
        fewer.ratio, fewer.show_render = _TRUTH_FACES / len(item.data.polygons), False
    armature = item.find_armature()
    if armature is not None:
        armature.hide_set(True)  # Its bones would be drawn over everything.


def color_view(space: Any) -> None:
    """Lets a 3D view show the colours of meshes, as the Solid view alone does not."""
    space.shading.type, space.shading.color_type = "SOLID", "VERTEX"


def color_solid_views(screen: bpy.types.Screen | None) -> None:
    """Lets the Solid views of a screen show the colours of meshes; other views are left."""
    for space in views_of(screen):
        if space.shading.type == "SOLID":
            color_view(space)


def hide_bones(screen: bpy.types.Screen | None) -> None:
    """Keeps the bones of armatures out of a screen's 3D views: they are drawn over everything."""
    for space in views_of(screen):
        space.overlay.show_bones = False


def views_of(screen: bpy.types.Screen | None) -> list[Any]:
    """The 3D views of a screen."""
    areas = screen.areas if screen else []
    return [area.spaces.active for area in areas if area.type == "VIEW_3D"]


def _views() -> list[Any]:
    """The 3D views that a file opens with: those of its windows, or of all screens without one."""
    windows = bpy.context.window_manager.windows
    screens = [window.screen for window in windows] or list(bpy.data.screens)
    return [space for screen in screens for space in views_of(screen)]


def _clear_the_way(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    points: Any,
    moving: Sequence[bpy.types.Object],
) -> None:
    """Closes the eyes of walls and the like between the camera and the Gaussians."""
    for item in moving:
        item.hide_set(True)  # Gaussians lie around it: it is in nobody's way.
    for _ in range(_MOST_HIDDEN):
        found = [item.name for hit, item in sight_lines(scene, camera, points) if hit and item]
        worst = max(sorted(set(found)), key=found.count, default=None)
        if worst is None or found.count(worst) < _IN_THE_WAY * len(points):
            break
        if worst not in bpy.context.view_layer.objects:
            break  # an instance of another file, which has no eye of its own
        scene.objects[worst].hide_set(True)
    for item in moving:
        item.hide_set(False)


@persistent
def _after_load(_path: object) -> None:
    """Opens our tab of the sidebar where the file asks for it."""
    collection = found_collection(bpy.context.scene, COLLECTION)
    if collection is not None and collection.get(_OPENS):
        steps = _open_tab(collection)
        bpy.app.timers.register(lambda: next(steps, None), first_interval=_PAUSE_S)


def _open_tab(collection: bpy.types.Collection) -> Iterator[float]:
    # Here, not when the file is made: Blender 5.2 without a window ends where a sidebar is shown.
    for window in bpy.context.window_manager.windows:
        for space in views_of(window.screen):
            space.show_region_ui = True
    for _ in range(_TRIES):
        regions = [
            region
            for window in bpy.context.window_manager.windows
            for area in window.screen.areas
            if area.type == "VIEW_3D"
            for region in area.regions
            if region.type == "UI"
        ]
        if regions and all(_turn_to_tab(region) for region in regions):
            break
        yield _PAUSE_S
    # Once: whoever saves the file then has it as they left it.
    del collection[_OPENS]


def _turn_to_tab(region: Any) -> bool:
    """Whether the tab could be turned to: a sidebar that was not drawn yet has none."""
    try:
        region.active_panel_category = "RF-GS"
    except (TypeError, AttributeError):  # Blender 5.2 calls it read-only until then.
        return False
    region.tag_redraw()
    return bool(region.active_panel_category == "RF-GS")


def register() -> None:
    """Watches what is opened, unless there is no window."""
    if not bpy.app.background:
        bpy.app.handlers.load_post.append(_after_load)


def unregister() -> None:
    """Watches no more."""
    if _after_load in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_after_load)
