# SPDX-License-Identifier: Apache-2.0
"""Colours of Gaussians by what they are asked to show, and the legend that goes with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from jaxtyping import Float, Float32, UInt8

from rfgs_core.view.frame import ShownFrame
from rfgs_core.view.selection import ColorMode

#: What each mode shows, as the panel says it.
TITLES: dict[ColorMode, str] = {
    "display": "display RGB (shader)",
    "power": "reflected power",
    "phase": "phase of reflectivity",
    "error": "distance to true surface",
    "sigma": "expected error of the limb",
}
#: What a page begins with is the first of these that a run has values for.
PREFERRED: tuple[ColorMode, ...] = ("error", "power", "display")
#: Colour of a Gaussian whose value is not known.
UNKNOWN = 0.45
#: Distances to the true surface end here [m]; F-scores count up to 0.20 m.
MOST_ERROR_M = 0.30
#: Power is shown between these percentiles, so that one strong Gaussian does not darken the rest.
POWER_PERCENTILES = (2.0, 99.5)
#: Least span of the power scale [dB]: equal powers are no rainbow.
LEAST_SPAN_DB = 3.0

#: Limbs expected to be further off than this are as good as unknown [m].
MOST_SIGMA_M = 0.20

_MAPS: dict[ColorMode, str] = {"power": "viridis", "error": "turbo", "sigma": "turbo"}
#: Saturation of the circle of hues that phases are shown on: none of them is dark.
_SATURATION = 0.8
_LEGEND_STOPS = 17


@dataclass(frozen=True)
class Scale:
    """Which values the ends of a colour map stand for."""

    low: float
    """Value at its first colour."""
    high: float
    """Value at its last colour."""

    def place(self, values: Float[np.ndarray, "M"]) -> Float[np.ndarray, "M"]:
        """Values as shares of the way from `low` to `high`, cut to [0, 1]."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)


def scales_of(frames: Sequence[ShownFrame]) -> dict[ColorMode, Scale]:
    """Scales of the modes that some of these frames have values for, the same for all frames."""
    known = np.concatenate([frame.power_db[np.isfinite(frame.power_db)] for frame in frames])
    found: dict[ColorMode, Scale] = {"display": Scale(0.0, 1.0)}
    if len(known):
        low, high = np.percentile(known, POWER_PERCENTILES)
        missing = max(0.0, LEAST_SPAN_DB - (high - low))
        found["power"] = Scale(float(low - missing), float(high))
    if any(np.isfinite(frame.phase_rad).any() for frame in frames):
        found["phase"] = Scale(-np.pi, np.pi)
    if any(np.isfinite(frame.error_m).any() for frame in frames):
        found["error"] = Scale(0.0, MOST_ERROR_M)
    if any(frame.sigma_m is not None for frame in frames):
        found["sigma"] = Scale(0.0, MOST_SIGMA_M)
    return {mode: found[mode] for mode in get_args(ColorMode) if mode in found}


def colors_of(frame: ShownFrame, mode: ColorMode, scale: Scale) -> Float32[np.ndarray, "M 3"]:
    """One colour per Gaussian, sRGB in [0, 1]."""
    if mode == "display":
        return frame.rgb
    values = {
        "power": frame.power_db,
        "phase": frame.phase_rad,
        "error": frame.error_m,
        "sigma": np.full(len(frame), np.nan) if frame.sigma_m is None else frame.sigma_m,
    }[mode]
    known = np.isfinite(values)
    rgb = np.full((len(frame), 3), UNKNOWN, np.float32)
    rgb[known] = _map(mode, scale.place(values[known]))
    return rgb


def legend_html(mode: ColorMode, scale: Scale) -> str:
    """A strip of the colour map with the values of its ends; empty for the display colours."""
    if mode == "display":
        return (
            '<div style="font-size:0.8em;opacity:0.75;padding:0 0.8em">Colour '
            "cannot come from radio: fitted to pictures afterwards, for display.</div>"
        )
    stops = ", ".join(hex_color(rgb) for rgb in _map(mode, np.linspace(0.0, 1.0, _LEGEND_STOPS)))
    ends = ends_of(mode, scale)
    return (
        '<div style="padding:0 0.8em">'
        f'<div style="height:0.8em;border-radius:3px;background:linear-gradient(90deg, {stops})">'
        '</div><div style="display:flex;justify-content:space-between;font-size:0.8em">'
        f"<span>{ends[0]}</span><span>{ends[1]}</span></div></div>"
    )


def ends_of(mode: ColorMode, scale: Scale) -> tuple[str, str]:
    """What the ends of a mode's colour map stand for, with their unit."""
    return {
        "display": ("", ""),
        "power": (f"{scale.low:.0f} dB", f"{scale.high:.0f} dB"),
        "phase": ("−180°", "180°"),
        "error": ("0 cm (right)", f"≥ {100 * scale.high:.0f} cm (wrong)"),
        "sigma": ("0 cm (sure)", f"≥ {100 * scale.high:.0f} cm (unknown)"),
    }[mode]


def strip_of(mode: ColorMode, width: int) -> UInt8[np.ndarray, "1 width 3"]:
    """The colour map of a mode as one row of pixels; not for the display colours."""
    return (_map(mode, np.linspace(0.0, 1.0, width)) * 255 + 0.5).astype(np.uint8)[None]


def _map(mode: ColorMode, shares: Float[np.ndarray, "M"]) -> Float32[np.ndarray, "M 3"]:
    from matplotlib import colormaps
    from matplotlib.colors import hsv_to_rgb

    if mode == "phase":
        full = np.ones_like(shares)
        rgb = hsv_to_rgb(np.stack([shares, _SATURATION * full, full], axis=-1))
    else:
        rgb = colormaps[_MAPS[mode]](shares)[:, :3]
    return rgb.astype(np.float32)


def hex_color(rgb: Float[np.ndarray, "3"]) -> str:
    """A colour, sRGB in [0, 1], as web pages write it."""
    red, green, blue = (np.asarray(rgb) * 255 + 0.5).astype(int)
    return f"#{red:02x}{green:02x}{blue:02x}"
