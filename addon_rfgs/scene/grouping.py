# SPDX-License-Identifier: GPL-3.0-or-later
"""Which moving surfaces are one thing: a body and its clothes, or two bodies on one armature."""

from __future__ import annotations

import numpy as np

from .survey import Surface

#: A surface may be a body of its own from this share of the largest's extent.
_BODY_SHARE = 0.7
#: Bodies are apart from this share of their extent on.
SEPARATE_SHARE = 0.3


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
            title = name if len(groups) == 1 else group[0].key
            for surface in group:
                names[surface.key] = title if len(shared) > 1 else surface.key
    return [(surface, names.get(surface.key, _own_name(surface))) for surface in moving]


def _own_name(surface: Surface) -> str:
    """Copies that an object makes of itself, as geometry nodes do, count as one with it."""
    return surface.source.name if surface.root == surface.source else surface.key


def _bodies(surfaces: list[Surface]) -> list[list[Surface]]:
    """Splits surfaces of one armature into bodies that stand apart from each other."""
    largest = max(_extent(surface) for surface in surfaces)
    bodies: list[list[Surface]] = []
    for surface in sorted(surfaces, key=_extent, reverse=True):
        distance = [
            float(np.hypot(*(stand(surface.vertices) - stand(body[0].vertices)))) for body in bodies
        ]
        near = int(np.argmin(distance)) if distance else -1
        whole = _extent(surface) >= _BODY_SHARE * largest
        if near < 0 or (whole and distance[near] > SEPARATE_SHARE * largest):
            bodies.append([surface])
        else:
            bodies[near].append(surface)
    return bodies


def _extent(surface: Surface) -> float:
    return float(np.ptp(surface.vertices, axis=0).max())


def stand(vertices: np.ndarray) -> np.ndarray:
    """Where something stands, [2]; the median is not led astray by an outstretched arm."""
    return np.median(vertices[:, :2], axis=0)
