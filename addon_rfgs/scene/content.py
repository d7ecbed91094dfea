# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything of a scene that does not depend on the frame, ready to be written or rendered."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from .absences import absences, hide_bone_shapes
from .bounds import Space, clip, find_space
from .cameras import cameras_ready
from .findings import Finding
from .frames import chosen_frames, unit_scale
from .lights import light_guesses
from .overrides import Overrides, Room, apply, moving_names
from .people import Instance, find_instances
from .scripts import disable_scripts, disabled_drivers, startup_texts
from .sheets import double_sheets
from .state import Keeper, kept, show_what_renders
from .surroundings import Surroundings, surroundings
from .survey import Surface, surface_of, survey


@dataclass
class Content:
    """Surfaces, instances and what there is to say about them."""

    overrides: Overrides
    keeper: Keeper
    """Remembers what further changes to the scene replace."""
    frames: list[int]
    """Frame numbers that were asked for."""
    surfaces: list[Surface]
    instances: list[Instance]
    guesses: list[dict[str, Any]]
    """Rows of `guesses.json`."""
    findings: list[Finding]
    space: Space | None = None
    """Where the scene is; None if nothing moves."""
    ring: list[bpy.types.Object] | None = None
    """Cameras made up for the scene, None if its own are used."""

    @property
    def moving(self) -> list[Surface]:
        """Surfaces that move, in the order of the bundle's vertices."""
        return [surface for surface in self.surfaces if surface.moving]

    @property
    def people(self) -> list[Instance]:
        """People, with known joints or without."""
        return [instance for instance in self.instances if instance.kind == "person"]

    @property
    def bounds(self) -> np.ndarray:
        """Lower and upper corner [2, 3] of what radio sees [m]."""
        assert self.space is not None, "only a scene in which something moves has bounds"
        return self.space.bounds

    def surroundings(self) -> Surroundings | None:
        """The room around the people; None where nothing moves or nothing stands still."""
        if self.space is None:
            return None
        return surroundings(self.surfaces, self.instances, self.bounds)


@contextmanager
def content_ready(
    scene: bpy.types.Scene, frames: str | None, overrides: Overrides, *, between: bool = False
) -> Iterator[Content]:
    """Makes the scene what the overrides say and surveys it; all is put back afterwards.

    Args:
        scene: Scene of the open file.
        frames: `A:B[:STEP]`, None for the scene's range.
        overrides: What the user says about the scene.
        between: Whether poses until the next frame are wanted too (`frames.chosen_frames`).

    Yields:
        The content; its findings may hold errors (`findings.refuse`).

    Raises:
        AddonError: There is no such range of frames, or a name matches nothing.
    """
    with kept(scene) as keeper:
        apply(overrides, keeper, scene)
        disable_scripts(keeper, scene)
        shapes = hide_bone_shapes(keeper)
        show_what_renders(keeper, scene)
        numbers = chosen_frames(scene, frames, between=between)
        content = _read(scene, numbers, overrides, keeper)
        content.findings += shapes
        if content.space is None:
            yield content
            return
        with (
            room_ready(scene, overrides.room, content.surfaces, content.space),
            cameras_ready(scene, content.space, overrides.cameras) as (ring, guesses),
        ):
            content.ring = ring
            content.guesses += guesses + content.space.guesses + light_guesses(scene)
            content.findings += content.space.findings
            yield content


def _read(
    scene: bpy.types.Scene, frames: list[int], overrides: Overrides, keeper: Keeper
) -> Content:
    surfaces, findings = survey(scene, moving_names(overrides))
    scene.frame_set(scene.frame_start)
    findings += [*absences(scene, surfaces, findings), *startup_texts()]
    findings += _emptiness(scene, surfaces)
    instances, guesses, wrong = find_instances(surfaces)
    guesses += disabled_drivers()
    content = Content(overrides, keeper, frames, surfaces, instances, guesses, findings + wrong)
    if content.moving:
        content.space = find_space(surfaces, overrides.bounds_m)
        _cut(content)
    content.findings += double_sheets(content.surfaces)
    return content


def _emptiness(scene: bpy.types.Scene, surfaces: list[Surface]) -> list[Finding]:
    if not surfaces:
        message = "no mesh that renders"
        return [Finding("error", "the scene", message, "RF-GS needs a scene with people")]
    if not any(surface.moving for surface in surfaces):
        message = f"no moving mesh in frames {scene.frame_start}:{scene.frame_end}"
        remedy = "RF-GS needs one that moves by more than 1 mm"
        return [Finding("error", "the scene", message, remedy, "no_motion")]
    return []


def _cut(content: Content) -> None:
    """Leaves of static surfaces what is within bounds that a user gave."""
    if content.overrides.bounds_m is None:
        return
    kept_surfaces = []
    for surface in content.surfaces:
        if surface.moving or clip(surface, content.bounds):
            kept_surfaces.append(surface)
        else:
            message = "is outside the bounds, left out of the radio scene"
            content.findings.append(Finding("info", surface.key, message))
    content.surfaces = kept_surfaces


NAME = "RFGS room"
#: Walls keep this far from other static surfaces, so that none coincide [m].
_CLEAR_M = 0.05
#: Corners of a face seen from inside; each indexes the box's corners x + 2 y + 4 z.
_INWARD = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@contextmanager
def room_ready(
    scene: bpy.types.Scene, room: Room | None, surfaces: list[Surface], space: Space
) -> Iterator[None]:
    """Builds the room for the duration of the block; adds its surface and updates `space`."""
    if room is None:
        yield
        return
    crowded = any(not surface.moving for surface in surfaces)
    low, high = _corners(room, space, _CLEAR_M if crowded else 0.0)
    if (space.movers[0] < low - 1e-3).any() or (space.movers[1] > high + 1e-3).any():
        message = f"the room of {np.round(high - low, 2).tolist()} m is smaller than what moves"
        space.findings.append(Finding("error", "the scene", message, "enlarge room: size_m"))
    item = _build(scene, room, low / unit_scale(scene), high / unit_scale(scene))
    try:
        surfaces.append(surface_of(scene, item))
        space.bounds = np.stack([low, high])
        space.walled = True
        space.findings[:] = [row for row in space.findings if "there is no room" not in row.message]
        yield
    finally:
        mesh, material = item.data, item.data.materials[0]
        bpy.data.meshes.remove(mesh)
        bpy.data.materials.remove(material)


def _corners(room: Room, space: Space, clear: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = space.bounds[0] - clear, space.bounds[1] + clear
    if room.size_m:
        middle, half = 0.5 * (low + high), 0.5 * np.array(room.size_m)
        floor = low[2]
        low, high = middle - half, middle + half
        low[2], high[2] = floor, floor + room.size_m[2]
    return low, high


def _build(
    scene: bpy.types.Scene, room: Room, low: np.ndarray, high: np.ndarray
) -> bpy.types.Object:
    corners = [[(low, high)[(index >> axis) & 1][axis] for axis in range(3)] for index in range(8)]
    mesh = bpy.data.meshes.new(NAME)
    mesh.from_pydata(corners, [], [list(face) for face in _INWARD])
    material = bpy.data.materials.new(f"{NAME} {room.material}")
    material.rfgs.radio_material = room.material
    mesh.materials.append(material)
    item = bpy.data.objects.new(NAME, mesh)
    item.visible_shadow = False  # Lamps outside go on lighting the scene.
    scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item
