# SPDX-License-Identifier: GPL-3.0-or-later
"""What the colour of imported Gaussians says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import bpy
import numpy as np

from ..errors import AddonError
from . import attributes, color_maps
from .splats import COLOR, SH_C0

#: The attribute that nodes, materials and the Solid view take colours from.
COLOR_ATTRIBUTE = "rfgs_color"
#: Features are kept in attributes of these names.
FEATURE_NAME = "f_{:02d}"
#: Attribute whose values a mode shows on the ramp, and what to do where no cloud has it.
RAMPED = {
    "POWER": ("rf_power_db", "import a run with its features.npz"),
    "ERROR": ("error_m", "press Compare with Mesh first"),
}


#: Powers within this span tell nothing apart: bodies whose limbs were told reflect alike [dB].
_LEAST_SPAN_DB = 3.0
#: Display colours within this are one, as where no picture was fitted.
_LEAST_COLOUR = 1e-4

#: What the colours of a cloud say is kept with it, for the legend.
SCALE = "rfgs_scale"


@dataclass(frozen=True)
class Scale:
    """What colours say."""

    mode: str
    """As in `Coloring`, but never AUTO."""
    low: float = 0.0
    """Value of the first colour of a ramp: dB, or metres for ERROR."""
    high: float = 1.0
    """Value of its last colour."""
    attribute: str = ""
    """Name of what ATTRIBUTE shows."""

    @classmethod
    def of(cls, mesh: bpy.types.Mesh) -> Scale:
        """What the colours of a cloud say."""
        return cls(**mesh[SCALE].to_dict())


@dataclass(frozen=True)
class Coloring:
    """What Gaussians are coloured by."""

    mode: str = "AUTO"
    """AUTO, DISPLAY, POWER, PHASE, FEATURES, ERROR, TRACK or ATTRIBUTE."""
    limits: tuple[float, float] | None = None
    """Ends of the ramp of POWER, ERROR and ATTRIBUTE; None finds them from the values."""
    attribute: str = ""
    """Name for ATTRIBUTE; a property of the PLY goes by its own name."""


def color_clouds(
    meshes: Sequence[bpy.types.Mesh], coloring: Coloring
) -> tuple[float, float] | None:
    """Writes the colours of all clouds.

    Returns:
        Ends of the ramp, None where the mode has none.

    Raises:
        AddonError: No cloud has what the mode shows.
    """
    mode = _chosen(meshes) if coloring.mode == "AUTO" else coloring.mode
    limits = None
    if mode == "DISPLAY":
        colors = [color_maps.linear(encoded_colors(mesh)) for mesh in meshes]
    elif mode == "PHASE":
        phases = _needed(meshes, "rf_phase", "import a run with its features.npz")
        colors = [color_maps.hues(phase / (2 * np.pi)) for phase in phases]
    elif mode == "TRACK":
        tracks = _needed(meshes, "gid", "import a run with its features.npz")
        colors = [color_maps.categories(ids) for ids in tracks]
    elif mode == "FEATURES":
        colors = _feature_colors(meshes)
    else:
        name, remedy = RAMPED.get(mode, (coloring.attribute, "see its name in the Spreadsheet"))
        values = _needed(meshes, name, remedy)
        limits = coloring.limits or color_maps.found_range(values)
        colors = [color_maps.ramp(array, *limits) for array in values]
    scale = Scale(mode, *(limits or (0.0, 1.0)), coloring.attribute)
    for mesh, rgb in zip(meshes, colors, strict=True):
        rgba = np.concatenate([rgb, np.ones((len(rgb), 1))], axis=1)
        attributes.put(mesh, COLOR_ATTRIBUTE, "FLOAT_COLOR", rgba)
        mesh.attributes.active_color_name = COLOR_ATTRIBUTE
        mesh[SCALE] = asdict(scale)
        mesh.update()
    return limits


def missing(meshes: Sequence[bpy.types.Mesh], coloring: Coloring) -> str | None:
    """The attribute that no cloud has and the mode needs, None if there is nothing to say."""
    needed = {
        "PHASE": "rf_phase",
        "FEATURES": FEATURE_NAME.format(0),
        "ERROR": "error_m",
        "ATTRIBUTE": coloring.attribute,
    }.get(coloring.mode)
    if needed is None or any(
        name in mesh.attributes for mesh in meshes for name in (needed, f"ply_{needed}")
    ):
        return None
    return needed or "(no name given)"


def encoded_colors(mesh: bpy.types.Mesh) -> np.ndarray:
    """Display colours as the PLY says, sRGB-encoded in [0, 1], [M, 3]; grey if it does not."""
    f_dc = [attributes.get(mesh, f"ply_{name}") for name in COLOR]
    if any(values is None for values in f_dc):
        return np.full((len(mesh.vertices), 3), 0.5)
    return np.clip(0.5 + SH_C0 * np.stack(f_dc, axis=1), 0, 1)


def _chosen(meshes: Sequence[bpy.types.Mesh]) -> str:
    """Power where it tells Gaussians of a frame apart, else display colours, else features."""
    powers = [attributes.get(mesh, "rf_power_db") for mesh in meshes]
    known = [values[np.isfinite(values)] for values in powers if values is not None]
    spans_db = [float(np.ptp(values)) for values in known if len(values)]
    if max(spans_db, default=0.0) >= _LEAST_SPAN_DB:
        return "POWER"
    colours = [float(np.ptp(encoded_colors(mesh))) for mesh in meshes if len(mesh.vertices)]
    if max(colours, default=0.0) >= _LEAST_COLOUR:
        return "DISPLAY"
    tables = [table for table in map(_features, meshes) if table is not None and len(table)]
    alike = len({table.shape[1] for table in tables}) == 1
    if alike and any(np.ptp(table, axis=0).any() for table in tables):
        return "FEATURES"
    return "POWER" if spans_db else "DISPLAY"


def _needed(meshes: Sequence[bpy.types.Mesh], name: str, remedy: str) -> list[np.ndarray]:
    """Values of an attribute of all clouds, NaN where a cloud lacks it."""
    found = []
    for mesh in meshes:
        values = attributes.get(mesh, name) if name else None
        if values is None and name:
            values = attributes.get(mesh, f"ply_{name}")
        found.append(values if values is not None and values.ndim == 1 else None)
    if not any(values is not None and np.isfinite(values).any() for values in found):
        raise AddonError(f"no Gaussian here has numbers of the name {name!r}; {remedy}")
    return [
        np.full(len(mesh.vertices), np.nan) if values is None else values.astype(np.float64)
        for mesh, values in zip(meshes, found, strict=True)
    ]


def _feature_colors(meshes: Sequence[bpy.types.Mesh]) -> list[np.ndarray]:
    tables = [_features(mesh) for mesh in meshes]
    known = [table for table in tables if table is not None]
    if not known:
        raise AddonError("no Gaussian here has features; import a run with its features.npz")
    if len({table.shape[1] for table in known}) > 1:
        raise AddonError("the clouds have features of different lengths; import one run alone")
    colors = iter(color_maps.principal_colors(known))
    return [
        np.full((len(mesh.vertices), 3), color_maps.UNKNOWN) if table is None else next(colors)
        for mesh, table in zip(meshes, tables, strict=True)
    ]


def _features(mesh: bpy.types.Mesh) -> np.ndarray | None:
    columns = []
    while (values := attributes.get(mesh, FEATURE_NAME.format(len(columns)))) is not None:
        columns.append(values)
    return np.stack(columns, axis=1) if columns else None
