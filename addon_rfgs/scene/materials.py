# SPDX-License-Identifier: GPL-3.0-or-later
"""Which radio material every face is made of, guessed where nobody said."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..naming import Names
from ..tables import MATERIALS
from .overrides import Overrides, RadioMaterial, first_match
from .survey import Surface

#: Words in names, lower case, and what they mean; earlier rows win.
KEYWORDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("plasterboard", ("plasterboard", "plaster", "drywall", "gypsum", "wallpaper")),
    ("ceiling_board", ("ceiling",)),
    ("chipboard", ("chipboard", "mdf", "particleboard")),
    ("plywood", ("plywood",)),
    ("concrete", ("concrete", "cement", "screed")),
    ("brick", ("brick", "bricks", "masonry")),
    ("marble", ("marble",)),
    ("glass", ("glass", "window", "windowpane", "mirror")),
    (
        "metal",
        (
            "metal",
            "steel",
            "iron",
            "aluminium",
            "aluminum",
            "chrome",
            "copper",
            "brass",
            "radiator",
        ),
    ),
    (
        "wood",
        (
            "wood",
            "wooden",
            "oak",
            "pine",
            "timber",
            "parquet",
            "door",
            "table",
            "shelf",
            "cupboard",
        ),
    ),
    ("skin", ("skin", "flesh")),
)

#: Reasons that are no guesses.
SAID = ("said from outside", "set in the file")

#: A mesh no thicker than this share of its size counts as flat.
_FLAT = 0.02


@dataclass
class MaterialTable:
    """The bundle's list of materials, and what had to be guessed to make it."""

    rows: list[dict[str, Any]]
    """Rows of `bundle.json`."""
    guesses: list[dict[str, Any]]
    """Rows of `guesses.json`."""

    def __init__(self, overrides: Overrides | None = None) -> None:
        self.rows, self.guesses = [], []
        self._overrides = overrides or Overrides()
        self._index: dict[tuple[str, RadioMaterial], int] = {}
        self._names = Names()

    def index(self, surface: Surface, slot: int) -> int:
        """Row of one material slot of a surface, made on first use."""
        material = surface.material(slot)
        value, why = self.decide(surface, slot)
        guessed = why not in SAID
        if guessed:
            self._note(surface, material, value.radio_material, why)
        key = ("" if material is None else material.name, value)
        if key not in self._index:
            self._index[key] = len(self.rows)
            self.rows.append(self._row(material, value, guessed))
        return self._index[key]

    def decide(self, surface: Surface, slot: int) -> tuple[RadioMaterial, str]:
        """Radio material of one slot of a surface, and why; one of `SAID` if a user said so."""
        material = surface.material(slot)
        names = surface.key, surface.source.name, surface.root.name
        chosen = first_match(self._overrides.object_materials, *names)
        if chosen is None and material is not None:
            chosen = first_match(self._overrides.materials, material.name)
        if chosen is not None:
            return chosen, SAID[0]
        if material is None:
            name, why = guess(surface, None)
            return RadioMaterial(name), why
        thickness_m = round(float(material.rfgs.thickness_m), 7)
        scattering = round(float(material.rfgs.scattering_coefficient), 7)
        name, why = material.rfgs.radio_material, SAID[1]
        if name == "AUTO":
            name, why = guess(surface, material)
        return RadioMaterial(name, thickness_m, scattering), why

    def _row(
        self, material: bpy.types.Material | None, value: RadioMaterial, guessed: bool
    ) -> dict[str, Any]:
        chosen = value.radio_material
        table = MATERIALS[chosen]
        return {
            "name": self._names.unique(material.name if material else f"default_{chosen}"),
            "source": "" if material is None else material.name,
            "radio_material": chosen,
            "thickness_m": value.thickness_m or table["thickness_m"],
            "scattering_coefficient": value.scattering_coefficient,
            "color": table["color"] if material is None else _colour(material),
            "guessed": guessed,
        }

    def _note(
        self, surface: Surface, material: bpy.types.Material | None, chosen: str, why: str
    ) -> None:
        label = surface.key if material is None else f"{surface.key}, material {material.name}"
        note = {"what": "radio_material", "object": label, "value": chosen, "why": why}
        if note not in self.guesses:
            self.guesses.append(note)


def guess(surface: Surface, material: bpy.types.Material | None) -> tuple[str, str]:
    """Radio material of a surface nobody labelled, and why."""
    for what, name in (
        ("material", material.name if material else ""),
        ("object", surface.source.name),
    ):
        words = _words(name)
        for value, keywords in KEYWORDS:
            hit = next((word for word in keywords if word in words), None)
            if hit:
                return value, f"{what} name contains {hit!r}"
    if surface.armature is not None:
        return "skin", f"skinned to {surface.armature.name!r}"
    if is_flat(surface.vertices):
        return "plasterboard", "flat"
    return "wood", "nothing else is known"


def is_flat(vertices: np.ndarray) -> bool:
    """Whether vertices [V, 3] lie in a plane within 2 % of their extent."""
    centred = vertices - vertices.mean(axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1]
    extent = np.ptp(centred @ axes, axis=0)
    return bool(extent.min() <= _FLAT * extent.max())


def _words(name: str) -> set[str]:
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return set(re.findall(r"[a-z]+", spaced.lower()))


def _colour(material: bpy.types.Material) -> list[float]:
    """Base colour, linear RGB: the main shader's where it is a constant."""
    # Coloured by radio material for the time being: its own colour is kept.
    colour = material.rfgs.own_color if material.rfgs.colored else material.diffuse_color
    for node in material.node_tree.nodes if material.node_tree else ():
        if node.type in {"BSDF_PRINCIPLED", "BSDF_DIFFUSE", "BSDF_GLASS", "BSDF_GLOSSY"}:
            socket = node.inputs.get("Base Color") or node.inputs.get("Color")
            if socket is not None and not socket.is_linked:
                colour = socket.default_value
                break
    return [round(float(value), 6) for value in colour[:3]]
