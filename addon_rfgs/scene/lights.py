# SPDX-License-Identifier: GPL-3.0-or-later
"""Light for scenes that bring none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

#: Strength and turn (radians about x and z) of a key and a fill sun.
_SUNS = ((2.5, 0.7, 0.6), (1.0, 1.0, 3.6))


def is_dark(scene: bpy.types.Scene) -> bool:
    """Whether no lamp, glowing material or bright world lights the scene."""
    if any(item.type == "LIGHT" and not item.hide_render for item in scene.objects):
        return False
    if any(_glows(material.node_tree) for material in bpy.data.materials):
        return False
    tree = scene.world.node_tree if scene.world else None
    for node in tree.nodes if tree else ():
        if node.type == "BACKGROUND":
            colour, strength = node.inputs["Color"], node.inputs["Strength"].default_value
            if colour.is_linked or strength * max(colour.default_value[:3]) > 0.2:
                return False
    return True


def light_guesses(scene: bpy.types.Scene) -> list[dict[str, Any]]:
    """The note about light for `guesses.json`."""
    if not is_dark(scene):
        return []
    note = {"what": "light", "object": "the scene", "value": "two suns for pictures"}
    return [{**note, "why": "the scene has no lamp, glowing material or bright world"}]


@contextmanager
def lights_ready(scene: bpy.types.Scene, walled: bool = False) -> Iterator[None]:
    """Lights a dark scene for the duration of the block.

    Args:
        scene: The scene.
        walled: Whether walls would keep the light out; then it goes through everything.
    """
    made = []
    if is_dark(scene):
        for strength, tilt, turn in _SUNS:
            lamp = bpy.data.lights.new("RFGS guessed", "SUN")
            lamp.energy, lamp.angle = strength, 0.3
            lamp.use_shadow = not walled
            item = bpy.data.objects.new("RFGS guessed", lamp)
            item.rotation_euler = (tilt, 0.0, turn)
            scene.collection.objects.link(item)
            made.append(lamp)
    try:
        yield
    finally:
        for lamp in made:
            bpy.data.lights.remove(lamp)


def _glows(tree: Any) -> bool:
    for node in tree.nodes if tree else ():
        if node.type == "EMISSION":
            return True
        strength = node.inputs.get("Emission Strength") if node.type == "BSDF_PRINCIPLED" else None
        if strength is not None and (strength.is_linked or strength.default_value > 0):
            colour = node.inputs["Emission Color"]
            if colour.is_linked or max(colour.default_value[:3]) > 0:
                return True
    return False
