# SPDX-License-Identifier: GPL-3.0-or-later
"""What the colours of Gaussians mean, drawn in the 3D view; adds nothing to the file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..ownership import found_collection
from . import color_maps
from .clouds import clouds_here
from .coloring import SCALE, Scale

#: Title of each mode, and how its values become numbers with a unit: factor, decimals, unit.
_MODES: dict[str, tuple[str, tuple[float, int, str] | None]] = {
    "DISPLAY": ("Display colours: fitted to pictures, not to radio", None),
    "POWER": ("Reflected power", (1.0, 0, "dB")),
    "ERROR": ("Distance to the true mesh", (100.0, 0, "cm")),
    "PHASE": ("Phase of the reflectivity", (1.0, 0, "°")),
    "FEATURES": ("Features: first three principal components", None),
    "TRACK": ("Tracks: a hue for each Gaussian", None),
    "ATTRIBUTE": ("Attribute", (1.0, 3, "")),
    "COVERAGE": ("Path gain to an isotropic antenna", (1.0, 0, "dB")),
}
_STEPS = 48
#: Ends of a scale that spans less are written with a decimal [dB].
_FINE_DB = 10.0
#: Place and size of the bar, from the lower left corner [px].
_LEFT_PX, _BOTTOM_PX, _WIDTH_PX, _HEIGHT_PX, _TEXT_PX = 24, 40, 220, 12, 12
#: How far one legend stands above another [px].
_UP_PX = 60
#: Collection of maps of coverage, whose colours are told here too.
COVERAGE = "RF-GS Coverage"

_handles: list[Any] = []


@dataclass(frozen=True)
class Legend:
    """Words and colours of the legend."""

    title: str
    """What the colours say."""
    ends: tuple[str, str] | None
    """Values of the first and last colour, with their unit; None where there is no scale."""
    colors: np.ndarray | None
    """Linear RGB of the scale, [step, 3]."""


def legend_of(scale: Scale) -> Legend:
    """The legend of colours that clouds have.

    Args:
        scale: What `color_clouds` has kept with them.
    """
    title, unit = _MODES[scale.mode]
    if scale.mode == "ATTRIBUTE":
        title = f"Attribute {scale.attribute}"
    if unit is None:
        return Legend(title, None, None)
    factor, decimals, name = unit
    low, high = (-180.0, 180.0) if scale.mode == "PHASE" else (scale.low, scale.high)
    if name == "dB" and high - low < _FINE_DB:
        decimals = 1
    ends = tuple(f"{factor * end:.{decimals}f} {name}".strip() for end in (low, high))
    steps = np.linspace(0.0, 1.0, _STEPS)
    hues = scale.mode == "PHASE"
    # Hues count from the positive x axis, and the bar begins at −180°.
    colors = color_maps.hues(steps - 0.5) if hues else color_maps.ramp(steps, 0.0, 1.0)
    return Legend(title, (ends[0], ends[1]), colors)


def register() -> None:
    """Adds the legend, unless there is no window to draw in."""
    if not bpy.app.background:
        add = bpy.types.SpaceView3D.draw_handler_add
        _handles.append(add(_draw, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    """Removes the legend."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def _draw() -> None:
    context = bpy.context
    space = context.space_data
    if not context.scene.rfgs.gaussians.legend or not space.overlay.show_overlays:
        return
    if space.shading.type == "SOLID" and space.shading.color_type != "VERTEX":
        return  # Nothing that is seen has these colours.
    maps = found_collection(context.scene, COVERAGE)
    row = 0
    for items in (clouds_here(context.scene), maps.objects if maps else ()):
        seen = [item for item in items if item.data and item.visible_get(viewport=space)]
        scale = next((Scale.of(item.data) for item in seen if SCALE in item.data), None)
        if scale is not None:
            _draw_legend(legend_of(scale), context.preferences.system.ui_scale, row)
            row += 1


def _draw_legend(legend: Legend, pixel: float, row: int) -> None:
    left, bottom = _LEFT_PX * pixel, (_BOTTOM_PX + row * _UP_PX) * pixel
    width, height = _WIDTH_PX * pixel, _HEIGHT_PX * pixel
    if legend.colors is not None and legend.ends is not None:
        x = np.repeat(np.linspace(left, left + width, len(legend.colors)), 2)
        y = np.tile([bottom, bottom + height], len(legend.colors))
        rgba = np.pad(np.repeat(legend.colors, 2, axis=0), ((0, 0), (0, 1)), constant_values=1.0)
        shader = gpu.shader.from_builtin("SMOOTH_COLOR")
        points = np.stack([x, y, np.zeros_like(x)], axis=1).astype(np.float32)
        content = {"pos": points.tolist(), "color": rgba.astype(np.float32).tolist()}
        batch_for_shader(shader, "TRI_STRIP", content).draw(shader)
        _write(legend.ends[0], left, bottom - 16 * pixel, pixel)
        far = blf.dimensions(0, legend.ends[1])[0]
        _write(legend.ends[1], left + width - far, bottom - 16 * pixel, pixel)
        bottom += height
    _write(legend.title, left, bottom + 6 * pixel, pixel)


def _write(text: str, x: float, y: float, pixel: float) -> None:
    blf.size(0, _TEXT_PX * pixel)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0.0, 0.0, 0.0, 0.9)
    blf.color(0, 1.0, 1.0, 1.0, 0.95)
    blf.position(0, x, y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)
