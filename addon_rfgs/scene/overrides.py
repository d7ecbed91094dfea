# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user says about a scene without touching the file: names, numbers, places."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

import bpy

from ..errors import AddonError
from ..naming import closest
from .state import Keeper


@dataclass(frozen=True)
class RadioMaterial:
    """Radio material of what a pattern matches."""

    radio_material: str
    thickness_m: float = 0.0
    """0 takes the material's own."""
    scattering_coefficient: float = 0.0


@dataclass(frozen=True)
class Ring:
    """Cameras on a circle around what moves, looking at its middle."""

    ring: int
    """How many."""
    radius_m: float | None = None
    height_m: float | None = None
    """Above the lowest point of what moves."""
    fov_deg: float | None = None
    """Opening angle of the longer side; None takes 60, and more where walls are near."""


@dataclass(frozen=True)
class Room:
    """A closed box of flat walls around the scene."""

    material: str = "plasterboard"
    size_m: tuple[float, float, float] | None = None
    """Along x, y, z; None fits the bounds."""


@dataclass(frozen=True)
class Overrides:
    """Everything that can be said about a scene from outside; None and empty leave it as it is.

    Names are patterns as in a shell: `*`, `?` and `[abc]`.
    """

    label: str = "the scene's configuration"
    """Where it came from, for messages."""
    frame_range: tuple[int, int] | None = None
    """First and last frame of the scene."""
    fps: float | None = None
    unit_scale: float | None = None
    """Metres per Blender unit."""
    bounds_m: tuple[tuple[float, ...], ...] | None = None
    """Lower and upper corner of what radio sees [m]."""
    drop: tuple[str, ...] = ()
    """Objects and devices that are left out, of radio and of pictures."""
    people: tuple[str, ...] = ()
    vehicles: tuple[str, ...] = ()
    moving: tuple[str, ...] = ()
    """Objects that count as moving although they may keep still."""
    materials: dict[str, RadioMaterial] = field(default_factory=dict)
    """By name of the Blender material."""
    object_materials: dict[str, RadioMaterial] = field(default_factory=dict)
    """By name of the object; goes before `materials`."""
    cameras: Ring | None = None
    devices: tuple[dict[str, Any], ...] = ()
    """Radio devices instead of the file's own."""
    room: Room | None = None


def apply(overrides: Overrides, keeper: Keeper, scene: bpy.types.Scene) -> None:
    """Makes the open scene what the overrides say, until `keeper` puts it back.

    Raises:
        AddonError: A pattern matches no object or material.
    """
    if overrides.frame_range:
        for name in ("frame_start", "frame_end"):
            keeper.remember(scene, name)
        scene.frame_end, scene.frame_start = overrides.frame_range[1], overrides.frame_range[0]
        scene.frame_end = overrides.frame_range[1]
    if overrides.fps:
        whole = max(1, round(overrides.fps))
        keeper.set(scene.render, "fps", whole)
        keeper.set(scene.render, "fps_base", whole / overrides.fps)
    if overrides.unit_scale:
        keeper.set(scene.unit_settings, "system", "METRIC")
        keeper.set(scene.unit_settings, "scale_length", overrides.unit_scale)
    classes = (
        ("people", overrides.people, "PERSON"),
        ("vehicles", overrides.vehicles, "VEHICLE"),
        ("drop", overrides.drop, "IGNORE"),
    )
    for key, patterns, value in classes:
        for item in matching_objects(patterns, f"{overrides.label}: {key}"):
            keeper.set(item.rfgs, "object_class", value)
            if value == "IGNORE":
                keeper.set(item, "hide_render", True)
                keeper.make_invisible(item)
                keeper.set(item.rfgs, "role", "NONE")
    for key in ("moving", "object_materials"):
        matching_objects(getattr(overrides, key), f"{overrides.label}: {key}")
    for pattern in overrides.materials:
        names = [item.name for item in bpy.data.materials]
        _matching(pattern, names, f"{overrides.label}: materials", "material")


def moving_names(overrides: Overrides) -> set[str]:
    """Names of the objects that shall count as moving."""
    found = matching_objects(overrides.moving, f"{overrides.label}: moving")
    return {item.name for item in found}


def matching_objects(patterns: Iterable[str], label: str) -> list[bpy.types.Object]:
    """Objects that a pattern matches.

    Raises:
        AddonError: A pattern matches none.
    """
    items = {item.name: item for item in bpy.data.objects}
    found = [name for text in patterns for name in _matching(text, items, label, "object")]
    return [items[name] for name in dict.fromkeys(found)]


def first_match(rules: dict[str, RadioMaterial], *names: str) -> RadioMaterial | None:
    """The first rule whose pattern fits one of `names`."""
    for pattern, value in rules.items():
        if any(_fits(name, pattern) for name in names):
            return value
    return None


def _fits(name: str, pattern: str) -> bool:
    """Whether a pattern means a name; a name with brackets means itself too."""
    return name == pattern or fnmatchcase(name, pattern)


def _matching(pattern: str, names: Iterable[str], label: str, what: str) -> list[str]:
    found = [name for name in names if _fits(name, pattern)]
    if not found:
        raise AddonError(f"{label}: no {what} matches {pattern!r}{closest(pattern, names)}")
    return found
