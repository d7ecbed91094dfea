# SPDX-License-Identifier: GPL-3.0-or-later
"""How imported Gaussians are shown: inputs of their modifiers, so a change needs no import."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from . import attributes
from .look import SPLAT_SIGMAS
from .nodes import GROUP, NO_POWER_DB, node_group, socket_ids

#: Surfaces that a ray of Cycles may pass, as many as it allows: of a splat it passes two.
_PASSED = 1024


@dataclass(frozen=True)
class Display:
    """How Gaussians are shown."""

    mode: str = "points"
    """`points`, equal spheres, `ellipsoids` of one standard deviation, or `splats`."""
    opacity_threshold: float = 0.005
    """Those below are hidden."""
    power_threshold_db: float = NO_POWER_DB
    """Those known to reflect less are hidden [dB]."""
    size: float = 1.0
    """Size of points, or how many standard deviations ellipsoids reach."""
    solid_view: bool = False
    """Real meshes, which the Solid view can colour."""
    crop_box: bpy.types.Object | None = None
    """An Empty; only Gaussians in the cube of half edge one around it are shown."""


def add_modifier(item: bpy.types.Object, display: Display) -> None:
    """Makes the points of `item` visible as Gaussians."""
    modifier: Any = item.modifiers.new(GROUP, "NODES")
    modifier.node_group = node_group()
    set_display(item, display)


def see_through(scene: bpy.types.Scene, display: Display) -> None:
    """Lets Cycles look through many splats: behind its usual eight surfaces all is black."""
    if display.mode == "splats" and hasattr(scene, "cycles"):
        scene.cycles.transparent_max_bounces = _PASSED


def set_display(item: bpy.types.Object, display: Display) -> None:
    """Changes what the modifier shows."""
    modifier: Any = item.modifiers[GROUP]
    sockets = socket_ids(modifier.node_group)
    splats = display.mode == "splats"
    for name, value in {
        "Ellipsoids": display.mode != "points",
        "Splats": splats,
        "Opacity Threshold": display.opacity_threshold,
        "Power Threshold": display.power_threshold_db,
        "Size": display.size * (SPLAT_SIGMAS if splats else 1.0),
        # The Solid view knows no opacity.
        "Solid View": display.solid_view and not splats,
        "Crop": display.crop_box is not None,
        "Crop Box": display.crop_box,
    }.items():
        if name in sockets:  # a group of an older version has fewer
            _set_input(modifier, sockets[name], value)
    item.update_tag()


def _set_input(modifier: Any, socket: str, value: Any) -> None:
    if hasattr(modifier, "properties"):  # Blender 5.2 moved the inputs out of the modifier.
        holder = getattr(modifier.properties.inputs, socket, None)
        if holder is not None:
            holder.value = value
            return
    modifier[socket] = value


def shown(item: bpy.types.Object, display: Display) -> np.ndarray:
    """Which points of a cloud these settings show, bool [M]; what the nodes do, in NumPy."""
    mesh = item.data
    keep = attributes.get(mesh, "opacity") >= np.float32(display.opacity_threshold)
    keep &= ~(attributes.get(mesh, "rf_power_db") < display.power_threshold_db)
    if display.crop_box is not None:
        inverse = np.array(display.crop_box.matrix_world.inverted_safe() @ item.matrix_world)
        local = attributes.positions(mesh) @ inverse[:3, :3].T + inverse[:3, 3]
        keep &= (np.abs(local) <= 1).all(axis=1)
    return keep
