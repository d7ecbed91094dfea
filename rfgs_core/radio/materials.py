# SPDX-License-Identifier: Apache-2.0
"""Radio materials a scene may use, with the band each model is valid in."""

from __future__ import annotations

from dataclasses import dataclass

from rfgs_core.radio.presets import Radio


@dataclass(frozen=True)
class RadioMaterial:
    """A slab material; permittivity comes from the ITU model or the tissue model of that name."""

    name: str
    """Name, an ITU-R P.2040 class in Sionna's spelling or `skin`."""
    freq_min_hz: float
    """Lower end of the model's validity [Hz]."""
    freq_max_hz: float
    """Upper end of the model's validity [Hz]."""
    thickness_m: float
    """Default thickness of the slab [m]."""
    colour: tuple[float, float, float]
    """Display colour, linear RGB in [0, 1]."""

    @property
    def model(self) -> str:
        """Where its permittivity comes from."""
        return "Gabriel et al. 1996" if self.name == "skin" else "ITU-R P.2040-4"

    def covers(self, radio: Radio) -> bool:
        """Whether the whole band of `radio` lies within the model's validity."""
        return self.freq_min_hz <= radio.freq_min_hz and radio.freq_max_hz <= self.freq_max_hz


#: Validity bands of ITU-R P.2040-4 as Sionna RT 2.2.0 enforces them; skin: Gabriel et al. 1996.
MATERIALS: dict[str, RadioMaterial] = {
    material.name: material
    for material in (
        RadioMaterial("concrete", 1e9, 100e9, 0.20, (0.50, 0.50, 0.50)),
        RadioMaterial("brick", 1e9, 40e9, 0.10, (0.60, 0.25, 0.18)),
        RadioMaterial("plasterboard", 1e9, 100e9, 0.0125, (0.85, 0.83, 0.78)),
        RadioMaterial("ceiling_board", 1e9, 100e9, 0.012, (0.90, 0.90, 0.88)),
        RadioMaterial("wood", 1e9, 100e9, 0.03, (0.45, 0.28, 0.14)),
        RadioMaterial("chipboard", 1e9, 100e9, 0.018, (0.62, 0.48, 0.30)),
        RadioMaterial("plywood", 1e9, 40e9, 0.018, (0.70, 0.55, 0.35)),
        RadioMaterial("floorboard", 50e9, 100e9, 0.02, (0.50, 0.33, 0.18)),
        RadioMaterial("marble", 1e9, 60e9, 0.02, (0.90, 0.88, 0.86)),
        RadioMaterial("glass", 1e9, 100e9, 0.006, (0.70, 0.85, 0.88)),
        RadioMaterial("metal", 1e9, 100e9, 0.002, (0.55, 0.56, 0.58)),
        RadioMaterial("skin", 1e7, 100e9, 0.30, (0.80, 0.58, 0.47)),
    )
}
