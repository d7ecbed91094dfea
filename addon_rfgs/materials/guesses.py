# SPDX-License-Identifier: GPL-3.0-or-later
"""What the names and uses of materials suggest, one answer for each material."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np

from ..ownership import need_own
from ..scene.frames import named
from ..scene.materials import guess
from ..scene.state import kept, show_what_renders
from ..scene.survey import Surface, surfaces_now


@dataclass(frozen=True)
class Guess:
    """One material and what it seems to be."""

    material: str
    radio_material: str
    why: str


def guesses(scene: bpy.types.Scene) -> list[Guess]:
    """Guesses for materials in use of which nobody said what they are, by name.

    Surfaces that share a material may suggest different things; the largest area decides.
    """
    with kept(scene) as keeper:
        show_what_renders(keeper, scene)
        surfaces = surfaces_now(scene)
    votes: dict[str, dict[tuple[str, str], float]] = {}
    for surface in surfaces:
        for slot, area in _areas(surface):
            material = surface.material(slot)
            if material is None or material.rfgs.radio_material != "AUTO":
                continue
            row = votes.setdefault(material.name, {})
            answer = guess(surface, material)
            row[answer] = row.get(answer, 0.0) + area
    return [_decide(name, row) for name, row in sorted(votes.items())]


def materials_in_use(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """Materials of the scene's objects by name."""
    slots = (slot for item in scene.objects for slot in item.material_slots)
    found = {slot.material.name: slot.material for slot in slots if slot.material}
    return [found[name] for name in sorted(found)]


def named_material(name: str) -> bpy.types.Material:
    """The material of a name.

    Raises:
        AddonError: There is none, or it is linked from another file.
    """
    material = named(bpy.data.materials, name, "material")
    need_own(material)
    return material


def settable(found: Iterable[Guess]) -> list[Guess]:
    """Guesses for materials of this file; linked ones are set where they come from."""
    return [row for row in found if bpy.data.materials[row.material].library is None]


def assign(
    materials: Iterable[bpy.types.Material],
    radio_material: str,
    thickness_m: float | None = None,
    scattering: float | None = None,
) -> int:
    """Sets what materials are to the radio; what is None stays. Returns how many."""
    count = 0
    for material in materials:
        material.rfgs.radio_material = radio_material
        if thickness_m is not None:
            material.rfgs.thickness_m = thickness_m
        if scattering is not None:
            material.rfgs.scattering_coefficient = scattering
        count += 1
    return count


def _decide(name: str, votes: dict[tuple[str, str], float]) -> Guess:
    (value, why), _ = max(sorted(votes.items()), key=lambda row: row[1])
    others = sorted({other for other, _ in votes} - {value})
    more = f"; elsewhere {' or '.join(others)}" if others else ""
    return Guess(name, value, why + more)


def _areas(surface: Surface) -> list[tuple[int, float]]:
    """Area of each slot in use [m²]."""
    corners = surface.vertices[surface.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(crossed, axis=1)
    return [(int(s), float(area[surface.slots == s].sum())) for s in np.unique(surface.slots)]
