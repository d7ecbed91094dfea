# SPDX-License-Identifier: GPL-3.0-or-later
"""How the properties of a radio are laid out, in the panel and where devices are added."""

from __future__ import annotations

import bpy

from .layout import arrays_of
from .properties import RadioFields

_LABELS = {"tx": "Transmitting array", "rx": "Receiving array"}


def draw_fields(layout: bpy.types.UILayout, rf: RadioFields, role: str) -> None:
    """Draws band, arrays, antennas and power of a radio, as far as a role uses them."""
    used = arrays_of(role)
    band = layout.column(align=True)
    for name in ("freq_min_ghz", "freq_max_ghz", "num_subcarriers"):
        band.prop(rf, name)
    for array in used:
        column = layout.column(align=True)
        column.label(text=_LABELS[array])
        column.prop(rf, f"{array}_rows", text="Rows")
        column.prop(rf, f"{array}_cols", text="Columns")
        column.prop(rf, f"{array}_spacing_wavelengths", text="Spacing [λ]")
        column.prop(rf, f"{array}_spacing_m", text="or [m]")
    column = layout.column(align=True)
    column.prop(rf, "pattern")
    column.prop(rf, "polarization")
    if "tx" in used:
        column.prop(rf, "power_dbm")
    if "rx" in used:
        column.prop(rf, "noise_figure_db")
    if used == ("tx", "rx"):
        layout.prop(rf, "tx_offset_m")
    layout.prop(rf, "own_device_links")
    layout.prop(rf, "isolation_db")
