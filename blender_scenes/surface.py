# SPDX-License-Identifier: GPL-3.0-or-later
"""One row of the tables of surfaces."""

from __future__ import annotations

from dataclasses import dataclass

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Surface:
    """A surface as Cycles and the ray tracer see it."""

    colour: Colour
    """Main colour, linear RGB."""
    radio: str
    """Radio material; every one used here is valid from 1 to 100 GHz."""
    thickness_m: float
    """Thickness of the slab [m]."""
    texture: str = "plain"
    """plain, planks, grain, weave, bricks, rug, lacquer, glow, beam or pane."""
    second: Colour = (0.0, 0.0, 0.0)
    """Second colour of the texture, linear RGB."""
    roughness: float = 0.6
    """Roughness of the highlight, 0 to 1."""
    metallic: float = 0.0
    """1 for bare metal."""
