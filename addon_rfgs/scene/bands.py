# SPDX-License-Identifier: GPL-3.0-or-later
"""The bands a scene's radios use, and which radio materials are known there."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..tables import MATERIALS, RADIO_FIELDS


@dataclass(frozen=True)
class Band:
    """A carrier frequency, or the band of a radio."""

    label: str
    """For messages."""
    low_hz: float
    high_hz: float

    @property
    def text(self) -> str:
        """In gigahertz."""
        low, high = self.low_hz / 1e9, self.high_hz / 1e9
        return f"{low:g} GHz" if low == high else f"{low:g}–{high:g} GHz"

    def within(self, material: str) -> bool:
        """Whether the model of a radio material is valid in the whole band."""
        row = MATERIALS[material]
        return row["freq_min_hz"] <= self.low_hz and self.high_hz <= row["freq_max_hz"]


def used_bands(scene: bpy.types.Scene) -> list[Band]:
    """The carrier that the user set, or else the bands of the scene's devices; may be none.

    A device for any radio names no band.
    """
    carrier_ghz = round(float(scene.rfgs.materials.carrier_ghz), 6)
    if carrier_ghz:
        return [Band("the carrier", carrier_ghz * 1e9, carrier_ghz * 1e9)]
    found = {}
    for item in scene.objects:
        radio = item.rfgs.radio.strip()
        if item.rfgs.role == "NONE" or (radio != "scene" and radio not in RADIO_FIELDS):
            continue
        fields = RADIO_FIELDS.get(radio) or item.rfgs.rf.row()
        found[radio] = Band(f"radio {radio!r}", fields["freq_min_hz"], fields["freq_max_hz"])
    return [found[name] for name in sorted(found)]


def validity(material: str) -> str:
    """The band in which a radio material is known, in words."""
    row = MATERIALS[material]
    return f"{row['freq_min_hz'] / 1e9:g}–{row['freq_max_hz'] / 1e9:g} GHz"


def out_of_band(material: str, bands: list[Band]) -> list[Band]:
    """Bands that a radio material's model does not cover."""
    return [band for band in bands if not band.within(material)]


def suitable(bands: list[Band]) -> list[str]:
    """Radio materials that are known in all of the bands, by name."""
    return sorted(name for name in MATERIALS if not out_of_band(name, bands))
