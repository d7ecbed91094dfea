# SPDX-License-Identifier: GPL-3.0-or-later
"""Which moving surfaces are one thing: a body and its clothes, or two bodies on one armature."""

from __future__ import annotations

import numpy as np

from .survey import Surface

#: Surfaces of one armature closer than this belong to one person [m].
_NEAR_M = 0.05
#: A part of an armature's surfaces is a body of its own from this share of the largest's size.
_BODY_SHARE = 0.5


def instance_names(moving: list[Surface]) -> list[tuple[Surface, str]]:
    """Each moving surface with the name of the instance it belongs to.

    That is the user's name, else the armature where it carries several meshes (numbered where
    these are several bodies), else the object that owns or instances the surface.
    """
    names: dict[str, str] = {}
    rigged: dict[str, list[Surface]] = {}
    for surface in moving:
        chosen = surface.root.rfgs.instance or surface.source.rfgs.instance
        if chosen:
            names[surface.key] = chosen
        elif surface.armature is not None:
            owner = "" if surface.root == surface.source else f"{surface.root.name}/"
            rigged.setdefault(f"{owner}{surface.armature.name}", []).append(surface)
    for name, shared in rigged.items():
        groups = _bodies(shared)
        for group in groups:
            title = name if len(groups) == 1 else _largest(group).key
            for surface in group:
                names[surface.key] = title if len(shared) > 1 else surface.key
    return [(surface, names.get(surface.key, _own_name(surface))) for surface in moving]


def _own_name(surface: Surface) -> str:
    """Copies that an object makes of itself, as geometry nodes do, count as one with it."""
    return surface.source.name if surface.root == surface.source else surface.key


def _bodies(surfaces: list[Surface]) -> list[list[Surface]]:
    """Splits surfaces of one armature into bodies that stand apart from each other."""
    groups: list[list[Surface]] = []
    for surface in surfaces:
        touching = [group for group in groups if any(_near(surface, other) for other in group)]
        groups = [group for group in groups if group not in touching]
        groups.append([surface, *(other for group in touching for other in group)])
    size = max(_extent(_largest(group)) for group in groups)
    bodies = [group for group in groups if _extent(_largest(group)) >= _BODY_SHARE * size]
    for group in groups:
        if group not in bodies:  # A hat or a shoe: part of the nearest body.
            middle = _middle(_largest(group))
            nearest = min(
                bodies, key=lambda body: float(np.linalg.norm(_middle(_largest(body)) - middle))
            )
            nearest.extend(group)
    return sorted(bodies, key=lambda body: _largest(body).key)


def _near(one: Surface, other: Surface) -> bool:
    low = np.maximum(one.vertices.min(axis=0), other.vertices.min(axis=0))
    high = np.minimum(one.vertices.max(axis=0), other.vertices.max(axis=0))
    return bool((low <= high + _NEAR_M).all())


def _extent(surface: Surface) -> float:
    return float(np.ptp(surface.vertices, axis=0).max())


def _middle(surface: Surface) -> np.ndarray:
    return 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))


def _largest(group: list[Surface]) -> Surface:
    return max(group, key=_extent)
