# SPDX-License-Identifier: GPL-3.0-or-later
"""True shapes beside Gaussians: outlines alone, so that renders show nothing but a result."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from .state import RAYS, Keeper

#: Tells outlines from what the user has taken from rays.
_MARK = "rfgs_outline"


def take_from_renders(item: bpy.types.Object) -> None:
    """Lets no ray of a render meet an object; it goes on counting as part of the scene."""
    item[_MARK] = True
    for kind in RAYS:
        setattr(item, f"visible_{kind}", False)


def give_to_renders(keeper: Keeper, items: Iterable[bpy.types.Object]) -> None:
    """Shows outlines in renders for a while: pictures of a dataset hold all that is traced."""
    for item in items:
        if item.get(_MARK):
            for kind in RAYS:
                keeper.set(item, f"visible_{kind}", True)
