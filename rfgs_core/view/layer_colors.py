# SPDX-License-Identifier: Apache-2.0
"""Colours and legends of the viewer's layers: ways of the waves, and how well places are heard."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8

from rfgs_core.view.colors import hex_color
from rfgs_core.view.coverage import HEIGHT_M, Coverage
from rfgs_core.view.rays import MORE, ONE, PEOPLE, STRAIGHT, Rays

_MAP, _STOPS, _PIXELS = "viridis", 9, 8


def coverage_colors(
    power_db: Float[np.ndarray, "*place"], scale_db: tuple[float, float]
) -> UInt8[np.ndarray, "*place 3"]:
    """Colours of powers [dB] between the ends of a scale, sRGB."""
    from matplotlib import colormaps

    low, high = scale_db
    shares = np.clip((power_db - low) / (high - low), 0.0, 1.0)
    return (255.0 * colormaps[_MAP](shares)[..., :3] + 0.5).astype(np.uint8)


def coverage_picture(coverage: Coverage) -> UInt8[np.ndarray, "h w 4"]:
    """The map seen from above, south in the first row, clear where no link reaches."""
    known = np.isfinite(coverage.power_db)
    rgb = coverage_colors(np.where(known, coverage.power_db, -1e3), coverage.scale_db)
    rgba = np.concatenate([rgb, np.where(known, 255, 0)[..., None].astype(np.uint8)], axis=-1)
    # A cell is several pixels: pages smooth between pixels.
    return np.repeat(np.repeat(rgba.swapaxes(0, 1), _PIXELS, axis=0), _PIXELS, axis=1)


def layers_html(rays: Rays | None, coverage: Coverage | None) -> str:
    """What the layers that are shown mean; empty without any."""
    parts = [] if rays is None else [_of_rays(rays)]
    parts += [] if coverage is None else [_of_coverage(coverage)]
    if not parts:
        return ""
    return f'<div style="padding:0 0.8em;font-size:0.8em">{"".join(parts)}</div>'


def _of_rays(rays: Rays) -> str:
    kinds = [("straight", STRAIGHT), ("one wall", ONE)]
    kinds += [("more", MORE), ("people", PEOPLE)] if rays.traced else []
    marks = " ".join(
        f'<span style="color:{hex_color(np.divide(rgb, 255.0))}">&#9632; {name}</span>'
        for name, rgb in kinds
    )
    source = "as traced" if rays.traced else "found by mirrors in the room"
    return f"<div>Ray paths, {source}: {marks}</div>"


def _of_coverage(coverage: Coverage) -> str:
    low, high = coverage.scale_db
    shown = coverage_colors(np.linspace(low, high, _STOPS), (low, high)) / 255.0
    colors = ", ".join(hex_color(rgb) for rgb in shown)
    strip = f"height:0.8em;border-radius:3px;background:linear-gradient(90deg, {colors})"
    ends = f"≤ {low:.0f} dB", f"≥ {high:.0f} dB"
    return (
        f"<div>Coverage: echo of 1 m² at {HEIGHT_M:g} m height, of all links that see it; "
        "bare where none does</div>"
        f'<div style="{strip}"></div><div style="display:flex;justify-content:space-between">'
        f"<span>{ends[0]}</span><span>{ends[1]}</span></div>"
    )
