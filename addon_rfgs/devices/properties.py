# SPDX-License-Identifier: GPL-3.0-or-later
"""The radio that Empties describe by themselves: band, arrays, antennas and power."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import bpy

from ..tables import MOST_ELEMENTS, RADIO_CHOICES, RADIO_DEFAULTS, RADIOS
from .layout import spacing_m, wavelength_m

_GHZ = 1e9


def search_radios(_self: object, _context: object, text: str) -> list[str]:
    """Radios that an Empty may belong to and that hold `text`."""
    return [name for name in ("any", "scene", *RADIOS) if text.lower() in name]


#: Stored word → what the panel calls it, and what it means.
_WORDS = {
    "iso": ("Isotropic", "Alike in all directions"),
    "dipole": ("Short dipole", "Nothing along its axis"),
    "hw_dipole": ("Half-wave dipole", "Nothing along its axis, a little narrower"),
    "tr38901": ("Panel (TR 38.901)", "Looks ahead, as base stations do"),
    "V": ("Vertical", "One port per element"),
    "H": ("Horizontal", "One port per element"),
    "VH": ("Vertical and horizontal", "Two ports per element"),
    "cross": ("Slanted by ±45°", "Two ports per element"),
    "included": ("Also", "A device hears its own transmitter and those of others"),
    "only": ("Alone", "A device hears its own transmitter alone"),
    "excluded": ("No", "A device hears others alone"),
}


def _choice(name: str, label: str, text: str) -> Any:
    """An enum whose stored numbers follow from the names, so a longer table shifts nothing."""
    items = [
        (value, *_WORDS[value], zlib.crc32(value.encode()) & 0x7FFFFFFF)
        for value in RADIO_CHOICES[name]
    ]
    default = RADIO_DEFAULTS[name]
    return bpy.props.EnumProperty(name=label, description=text, items=items, default=default)


def _count(name: str, label: str, text: str, **limits: int) -> Any:
    return bpy.props.IntProperty(
        name=label, description=text, default=RADIO_DEFAULTS[name], **limits
    )


def _elements(name: str, label: str, axis: str) -> Any:
    return _count(name, label, f"Elements along local {axis}", min=1, max=MOST_ELEMENTS)


def _level(name: str, label: str, text: str, **limits: float) -> Any:
    return bpy.props.FloatProperty(
        name=label, description=text, default=RADIO_DEFAULTS[name], precision=1, **limits
    )


def _spacing_m(name: str, label: str) -> Any:
    return bpy.props.FloatProperty(
        name=label,
        # No unit subtype: Blender would take it for its own units, which need not be metres.
        description="Distance of neighbouring elements [m]; 0 takes half a wavelength of any band",
        default=RADIO_DEFAULTS[name],
        min=0.0,
        soft_max=1.0,
        precision=4,
        step=0.1,
    )


def _spacing_wavelengths(array: str, label: str) -> Any:
    """The same distance in wavelengths: nothing more is stored."""

    def read(self: RadioFields) -> float:
        fields = RadioFields.row(self)  # Operators hand over their bare properties.
        return spacing_m(fields, array) / wavelength_m(fields)

    def write(self: RadioFields, value: float) -> None:
        value_m = value * wavelength_m(RadioFields.row(self))
        setattr(self, f"{array}_spacing_m", 0.0 if abs(value - 0.5) < 1e-6 else value_m)

    return bpy.props.FloatProperty(
        name=label,
        description="Distance of neighbouring elements in wavelengths at the middle of the band",
        get=read,
        set=write,
        min=0.01,
        soft_max=10.0,
        precision=3,
    )


def _edge_ghz(name: str, label: str) -> Any:
    return bpy.props.FloatProperty(
        name=label,
        description="Edge of the band [GHz]",
        default=RADIO_DEFAULTS[name] / _GHZ,
        min=0.01,
        max=100.0,
        precision=4,
    )


class RadioFields:
    """Fields of a radio as properties, of Empties and of the operator that adds them."""

    freq_min_ghz: _edge_ghz("freq_min_hz", "From [GHz]")
    freq_max_ghz: _edge_ghz("freq_max_hz", "To [GHz]")
    num_subcarriers: _count(
        "num_subcarriers",
        "Subcarriers",
        "Subcarriers at the centres of equal slices of the band",
        min=2,
    )
    tx_rows: _elements("tx_rows", "TX rows", "z")
    tx_cols: _elements("tx_cols", "TX columns", "y")
    rx_rows: _elements("rx_rows", "RX rows", "z")
    rx_cols: _elements("rx_cols", "RX columns", "y")
    tx_spacing_m: _spacing_m("tx_spacing_m", "TX spacing [m]")
    rx_spacing_m: _spacing_m("rx_spacing_m", "RX spacing [m]")
    tx_spacing_wavelengths: _spacing_wavelengths("tx", "TX spacing [λ]")
    rx_spacing_wavelengths: _spacing_wavelengths("rx", "RX spacing [λ]")
    tx_offset_m: bpy.props.FloatVectorProperty(
        name="TX offset [m]",
        description="Centre of the TX array in the Empty's axes [m]; the RX array is at its origin",
        size=3,
        default=RADIO_DEFAULTS["tx_offset_m"],
    )
    own_device_links: _choice(
        "own_device_links", "Monostatic links", "Whether a device hears its own transmitter"
    )
    isolation_db: _level(
        "isolation_db",
        "Isolation [dB]",
        "Of a device's receiver from its transmitter [dB]",
        min=0.0,
    )
    power_dbm: _level("power_dbm", "Power [dBm]", "Transmit power")
    noise_figure_db: _level("noise_figure_db", "Noise [dB]", "Noise figure of the receiver [dB]")
    pattern: _choice("pattern", "Pattern", "Antenna pattern")
    polarization: _choice(
        "polarization", "Polarisation", "V, H, or two ports per element: VH, cross"
    )

    def row(self) -> dict[str, Any]:
        """The fields under the names of a radio file, free of single precision's tails."""
        out: dict[str, Any] = {}
        for name in RADIO_DEFAULTS:
            if name in ("freq_min_hz", "freq_max_hz"):
                # Single precision holds a kilohertz at 10 GHz.
                out[name] = round(getattr(self, name.replace("_hz", "_ghz")), 6) * _GHZ
                continue
            value = getattr(self, name)
            if name == "tx_offset_m":
                out[name] = [round(float(part), 6) for part in value]
            else:
                out[name] = round(value, 6) if isinstance(value, float) else value
        return out

    def take(self, fields: Mapping[str, Any]) -> None:
        """Sets fields given under the names of a radio file; the others stay."""
        for name, value in fields.items():
            if name in ("freq_min_hz", "freq_max_hz"):
                setattr(self, name.replace("_hz", "_ghz"), value / _GHZ)
            else:
                setattr(self, name, value)


class RFGS_PG_radio(RadioFields, bpy.types.PropertyGroup):
    """Fields of the radio `scene`, the same at every Empty of it; units as in the names."""
