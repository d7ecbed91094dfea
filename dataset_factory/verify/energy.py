# SPDX-License-Identifier: Apache-2.0
"""How energy falls with distance: in free space, and echoed by a plate."""

from __future__ import annotations

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, near
from dataset_factory.verify.closed_forms import friis
from dataset_factory.verify.description import MARKER, Description, Device, Part, stepping
from dataset_factory.verify.physical_optics import cuboid, scattered
from dataset_factory.verify.tracing import echoes, monostatic, single, static_links
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import layout, preset
from rfgs_core.radio.levels import decibels

#: Largest error of the exponents of |H|² over distance.
SPACE, ECHO = 0.02, 0.05
DISTANCES_M = tuple(float(d) for d in np.geomspace(0.5, 12.0, 12))
RANGES_M = tuple(float(d) for d in np.geomspace(2.5, 10.0, 10))
PLATE_M = (0.32, 0.02, 0.32)

#: One transmitter, and receivers ever farther away around it.
SPREAD = Description(
    (stepping(MARKER, [(0.0, 0.0, 3.0), (0.1, 0.0, 3.0)]),),
    (
        Device("a", (0.0, 0.0, 1.2), role="TRANSMITTER"),
        *(
            Device(
                f"b{n:02d}",
                (d * float(np.cos(n)), d * float(np.sin(n)), 1.2),
                role="RECEIVER",
            )
            for n, d in enumerate(DISTANCES_M)
        ),
    ),
)
#: A plate that goes away from a device that it faces.
RECEDING = Description(
    (
        stepping(
            Part("plate", "box", PLATE_M, cells=4, kind="AUTO"),
            [(0.0, -d - PLATE_M[1] / 2, 1.2) for d in RANGES_M],
        ),
    ),
    (Device("a", (0.0, 0.0, 1.2)),),
    frames=len(RANGES_M),
)


def verify(workshop: Workshop) -> Group:
    """Fits exponents of the energy over the distance."""
    radio = single(preset("wifi"))
    bundle = workshop.bundle(SPREAD)
    found = static_links(workshop, bundle, radio)
    distance = found.distance_m
    there = np.mean(np.abs(found.channel) ** 2, axis=1)
    exact = np.mean(np.abs(friis(radio.freq_hz, distance)) ** 2, axis=1)
    radar = monostatic(preset("wifi24"), 8)
    bundle = workshop.bundle(RECEDING)
    back = np.mean(np.abs(echoes(workshop, bundle, radar)[:, 0, 0]) ** 2, axis=1)
    elements = layout(radar, devices_of(bundle, radar))
    ends = elements.tx_xyz[0], elements.rx_xyz[0]
    plates = [cuboid(PLATE_M, (0.0, -d - PLATE_M[1] / 2, 1.2)) for d in RANGES_M]
    optics = np.array(
        [np.mean(np.abs(scattered([each], *ends, radar.freq_hz)) ** 2) for each in plates]
    )
    ranges = np.array(RANGES_M)
    rows = [
        near("free space, exponent", 2.0, exponent(distance, there), SPACE, "", "Friis (1946)"),
        near(
            "echo of a plate, exponent",
            4.0,
            exponent(ranges, back),
            ECHO,
            "",
            "radar equation, R⁻⁴ in the far field",
        ),
    ]
    plots = [
        _plot("Free space", distance, exact, there, "Friis"),
        _plot("Echo of a plate at 2.4 GHz", ranges, optics, back, "physical optics"),
    ]
    return Group(
        "energy",
        "Energy over distance",
        "The exponent n of |H|² ∝ d⁻ⁿ, fitted over twelve receivers from 0.5 to 12 m, and over a "
        "plate of 32 cm that faces a Wi-Fi device at 2.4 GHz from 2.5 to 10 m.",
        rows,
        plots,
    )


def exponent(distance_m: np.ndarray, power: np.ndarray) -> float:
    """Exponent n of power ∝ distance⁻ⁿ, by least squares on logarithms."""
    return float(-np.polyfit(np.log(distance_m), np.log(power), 1)[0])


def _plot(title: str, distance: np.ndarray, exact: np.ndarray, got: np.ndarray, form: str) -> Plot:
    curves = [
        Curve(form, distance, decibels(exact), "closed form"),
        Curve("measured", distance, decibels(got), "measured"),
    ]
    return Plot(title, "distance [m]", "|H|² [dB]", curves, log_x=True)
