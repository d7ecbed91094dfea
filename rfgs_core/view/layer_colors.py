# SPDX-License-Identifier: Apache-2.0
"""Colours and legends of the viewer's layers: ways of the waves, and how well places are heard."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8

from rfgs_core.view.colors import hex_color
from rfgs_core.view.coverage import HEIGHT_M, SPAN_DB, Coverage
from rfgs_core.view.rays import MORE, ONE, PEOPLE, STRAIGHT, Rays

_MAP, _STOPS = "viridis", 9


def coverage_colors(
    power_db: Float[np.ndarray, "place"], top_db: float
) -> UInt8[np.ndarray, "place 3"]:
    """Colours of powers [dB] from `SPAN_DB` below `top_db` up to it, sRGB."""
    from matplotlib import colormaps

    shares = np.clip(1.0 + (power_db - top_db) / SPAN_DB, 0.0, 1.0)
    return (255.0 * colormaps[_MAP](shares)[:, :3] + 0.5).astype(np.uint8)


def layers_html(rays: Rays | None, coverage: Coverage | None) -> str:
    """What the layers that are shown mean; empty without any."""
    parts = [] if rays is None else [_of_rays(rays)]
    parts += [] if coverage is None else [_of_coverage(coverage)]
    if not parts:
        return ""
    return f'<div style="padding:0 0.8em;font-size:0.8em">{"".join(parts)}</div>'


def _of_rays(rays: Rays) -> str:
    kinds = [("straight", STRAIGHT), ("one wall", ONE), ("more", MORE)]
    kinds += [("people", PEOPLE)] if rays.traced else []
    marks = " ".join(
        f'<span style="color:{hex_color(np.divide(rgb, 255.0))}">&#9632; {name}</span>'
        for name, rgb in kinds
    )
    source = "as traced" if rays.traced else "found by mirrors in the room"
    return f"<div>Ray paths, {source}: {marks}</div>"


def _of_coverage(coverage: Coverage) -> str:
    stops = coverage.top_db - SPAN_DB * np.linspace(1.0, 0.0, _STOPS)
    colors = ", ".join(
        hex_color(np.divide(rgb, 255.0)) for rgb in coverage_colors(stops, coverage.top_db)
    )
    strip = f"height:0.8em;border-radius:3px;background:linear-gradient(90deg, {colors})"
    ends = f"{coverage.top_db - SPAN_DB:.0f} dB", f"{coverage.top_db:.0f} dB"
    return (
        f"<div>Coverage: echo of 1 m² at {HEIGHT_M:g} m height, of all links that see it; "
        "bare where none does</div>"
        f'<div style="{strip}"></div><div style="display:flex;justify-content:space-between">'
        f"<span>{ends[0]}</span><span>{ends[1]}</span></div>"
    )
