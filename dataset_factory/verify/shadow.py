# SPDX-License-Identifier: Apache-2.0
"""Shadows of moving screens: knife edge and slab against Fresnel's integrals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, Row, near, within
from dataset_factory.verify.closed_forms import C, db, fresnel_integral
from dataset_factory.verify.description import Description, Device, Part, stepping
from dataset_factory.verify.tracing import single
from dataset_factory.verify.workshop import Workshop
from rfgs_core.radio import Radio, preset

#: Largest error of the factor T, and of the level at grazing [dB].
FACTOR, GRAZING_DB = 0.003, 0.1
#: Distances of the screen from transmitter and receiver [m]. Beyond 20 Fresnel zones a screen
#: counts as unbounded, so these are short.
D_1, D_2, MIDDLE_M = 0.9, 1.1, 2.5
#: Half the extent of an unbounded screen in Fresnel zones, at the highest frequency.
UNBOUNDED = 22.0
#: Places of the edge in Fresnel coordinates at the middle of a band.
NU = np.linspace(-3.0, 3.0, 13)
#: Places far from the line, in Fresnel coordinates at the top of a band.
FAR_NU = np.array([-9.5, -8.0, -6.5, -5.0, 5.0, 6.5, 8.0, 9.5])
SLAB_M = 0.4
KNIFE = "half plane, ITU-R P.526-15 eq. 31 exact: T = (1+j)/2 ∫_ν^∞ e^{−jπt²/2} dt"
SLAB = "Fresnel–Kirchhoff integral over a strip, Born and Wolf (1999), section 8.7"


@dataclass(frozen=True)
class Screen:
    """An upright screen across the line of sight that stands elsewhere in each frame."""

    width_m: float
    """Its width [m]."""
    height_m: float
    """Its height [m], half above and half below the line."""
    edges_m: tuple[float, ...]
    """Where its upper edge across the line is in each frame [m]; 0 touches the line."""

    def scene(self) -> Description:
        """A sheet without rims, and devices on both sides of it."""
        places = [(D_1, edge - self.width_m / 2, MIDDLE_M) for edge in self.edges_m]
        size = (self.height_m, self.width_m, 0.0)
        part = Part("screen", "sheet", size, turn_deg=(0.0, 90.0, 0.0), kind="PERSON")
        devices = (
            Device("a", (0.0, 0.0, MIDDLE_M), role="TRANSMITTER"),
            Device("b", (D_1 + D_2, 0.0, MIDDLE_M), role="RECEIVER"),
        )
        return Description((stepping(part, places),), devices, frames=len(places))


def per_m(freq_hz: np.ndarray | float) -> np.ndarray:
    """Fresnel coordinates per metre beside the line, ν = y √(2/λ (1/d_1 + 1/d_2)) [1/m]."""
    return np.sqrt(2.0 * (1.0 / D_1 + 1.0 / D_2) * np.asarray(freq_hz) / C)


def knife_edge(nu: np.ndarray) -> np.ndarray:
    """Factor of a half plane whose edge is ν above the line of sight (ITU-R P.526-15, 4.1)."""
    return 0.5 * (1.0 + 1j) * (0.5 - 0.5j - fresnel_integral(nu))


def strip(nu_low: np.ndarray, nu_high: np.ndarray) -> np.ndarray:
    """Factor of an endless strip between two Fresnel coordinates: Babinet's complement."""
    return 1.0 - 0.5 * (1.0 + 1j) * (fresnel_integral(nu_high) - fresnel_integral(nu_low))


def verify(workshop: Workshop) -> Group:
    """Traces half planes and slabs in several bands."""
    rows: list[Row] = []
    plots = []
    bands = {
        "wifi": single(preset("wifi")),
        "60–64 GHz": single(preset("mmwave"), num_subcarriers=64),
        "3.1–10.6 GHz": single(
            preset("uwb"), rx_spacing_m=0.0, num_subcarriers=152, placement="corners"
        ),
    }
    for name, radio in bands.items():
        edges = tuple(float(nu) for nu in NU / per_m(radio.centre_hz))
        half_m = UNBOUNDED / float(per_m(radio.freq_max_hz))
        found = _factors(workshop, Screen(half_m + edges[-1], 2.0 * half_m, edges), radio)
        nu = np.outer(edges, per_m(radio.freq_hz))
        exact = knife_edge(nu)
        rows.append(_worst(f"knife edge, {name}", found, exact, KNIFE))
        touching = np.mean(found[len(NU) // 2])
        label = f"knife edge at grazing, {name}"
        rows.append(near(label, -6.0206, float(db(touching)), GRAZING_DB, "dB", KNIFE))
        plots.append(_plot(f"Knife edge, {name}", found, exact, radio))
        rows.append(_far(workshop, name, radio, half_m))
        found = _factors(workshop, Screen(SLAB_M, 2.0 * half_m, edges), radio)
        exact = strip(nu - SLAB_M * per_m(radio.freq_hz), nu)
        rows.append(_worst(f"slab of 40 cm, {name}", found, exact, SLAB))
    return Group(
        "shadow",
        "Shadows: knife edge and Fresnel slab",
        "A screen that moves across the line of sight, 0.9 m from the transmitter and 1.1 m from "
        "the receiver: csi over csi_static, every subcarrier of the band, beside Fresnel's "
        "integrals. The edge is from ν = −3 to 3 above the line, at the middle of the band, and "
        "far from it, up to ν = ±9.5 at the top of the band. What lies wholly beyond ν = 10 is "
        "left out by the tracer; it would change a path by less than 0.023.",
        rows,
        plots,
    )


def _far(workshop: Workshop, name: str, radio: Radio, half_m: float) -> Row:
    """Edges whose shadow turns most over the band: at the top, up to ν = 9.5 from the line."""
    edges = tuple(float(nu) for nu in FAR_NU / per_m(radio.freq_max_hz))
    screen = Screen(half_m + edges[-1], 2.0 * half_m, edges)
    found = _factors(workshop, screen, radio)
    exact = knife_edge(np.outer(edges, per_m(radio.freq_hz)))
    return _worst(f"knife edge far from the line, {name}", found, exact, KNIFE)


def _factors(workshop: Workshop, screen: Screen, radio: Radio) -> np.ndarray:
    """Csi / csi_static of the only link, shape (frame, subcarrier)."""
    bundle = workshop.bundle(screen.scene())
    tracer = workshop.traced(bundle, radio, depth=1)
    static = tracer.static().astype(np.complex128)[0, 0]
    return np.stack([tracer.frame(bundle.frame(n))[0, 0] / static for n in bundle.frames])


def _worst(name: str, found: np.ndarray, exact: np.ndarray, source: str) -> Row:
    error = float(np.abs(found - exact).max())
    return within(f"{name}, worst |T − T₀|", error, FACTOR, "", source)


def _plot(title: str, found: np.ndarray, exact: np.ndarray, radio: Radio) -> Plot:
    """Level over ν at the lowest subcarrier of the band."""
    nu = NU * float(per_m(radio.freq_hz[0]) / per_m(radio.centre_hz))
    fine = np.linspace(nu[0], nu[-1], 300)
    curves = [
        Curve("Fresnel integral", fine, db(knife_edge(fine)), "closed form"),
        Curve("csi / csi_static", nu, db(found[:, 0]), "measured"),
    ]
    return Plot(title + ", lowest subcarrier", "ν of the edge", "|T| [dB]", curves)
