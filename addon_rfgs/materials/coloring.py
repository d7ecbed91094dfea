# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours materials in the viewport by what they are to the radio, and puts their own back.

The own colour is kept at the material, so that it survives saving, and removed when it is back.
"""

from __future__ import annotations

import colorsys

import bpy

from ..tables import MATERIALS

#: Turn of the hue from one material to the next: far from its neighbours at any count.
_GOLDEN = 0.381966
#: Saturation and value by turns, so that near hues differ too.
_SHADES = ((0.75, 0.9), (0.45, 1.0), (0.85, 0.55))
#: Of materials that nobody said anything about.
_UNKNOWN = (0.35, 0.35, 0.35, 1.0)


def radio_color(name: str) -> tuple[float, float, float, float]:
    """RGBA that tells a radio material from all others; grey for one that is to be guessed."""
    if name not in MATERIALS:
        return _UNKNOWN
    index = list(MATERIALS).index(name)
    shade = _SHADES[index % len(_SHADES)]
    return (*colorsys.hsv_to_rgb((0.02 + _GOLDEN * index) % 1.0, *shade), 1.0)


def colored() -> list[bpy.types.Material]:
    """Materials that show their radio material for the time being."""
    return [material for material in bpy.data.materials if material.rfgs.colored]


def color(materials: list[bpy.types.Material]) -> int:
    """Colours materials by radio material; linked ones cannot be written and stay.

    Returns:
        How many.
    """
    own = [material for material in materials if material.library is None]
    for material in own:
        if not material.rfgs.colored:
            material.rfgs.own_color = material.diffuse_color
            material.rfgs.colored = True
        recolor(material)
    return len(own)


def recolor(material: bpy.types.Material) -> None:
    """Gives a coloured material the colour of what it is now."""
    material.diffuse_color = radio_color(material.rfgs.radio_material)


def restore() -> int:
    """Puts every material's own colour back, and leaves nothing behind; returns how many."""
    changed = colored()
    for material in changed:
        material.diffuse_color = material.rfgs.own_color
        for name in ("own_color", "colored"):
            material.rfgs.property_unset(name)
    return len(changed)
