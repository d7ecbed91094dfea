# SPDX-License-Identifier: Apache-2.0
"""A furnished room in both directions: transmitter and receiver exchanged, every pair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.verify.card import Group, Row, within
from dataset_factory.verify.description import Description, Device, Part, room, stepping
from dataset_factory.verify.tracing import single
from dataset_factory.verify.workshop import Workshop
from rfgs_core.radio import Radio, preset
from rfgs_core.radio.levels import decibels

#: Largest error power of a pair over that pair's power [dB].
WORST_DB = -60.0
SOURCE = "Lorentz reciprocity: H(a→b) = H(b→a)"
#: A box of a person's size on a straight way between two places.
PERSON = Part("person", "box", (0.35, 0.25, 1.7), kind="PERSON", material="skin", cells=6)
#: A room with a table, a cabinet of sheet metal and a pane of glass.
FURNISHED = Description(
    (
        *room((5.0, 4.0, 2.6), "plasterboard"),
        Part("table top", "box", (1.4, 0.8, 0.04), (3.4, 1.3, 0.74), "wood"),
        *(
            Part(f"table leg {n}", "box", (0.06, 0.06, 0.7), (x, y, 0.365), "wood")
            for n, (x, y) in enumerate(((2.8, 1.0), (4.0, 1.0), (2.8, 1.6), (4.0, 1.6)))
        ),
        Part("cabinet", "box", (0.9, 0.45, 1.8), (1.0, 3.7, 0.91), "metal"),
        Part("pane", "sheet", (1.4, 1.2, 0.0), (2.3, 3.1, 1.2), "glass", 0.006, (0.0, 90.0, 0.0)),
        stepping(PERSON, [(1.6, 1.5, 0.87), (1.9, 1.7, 0.87)]),
    ),
    (
        Device("a", (0.2, 0.2, 1.2), 40.0),
        Device("b", (4.8, 0.2, 2.2), 140.0),
        Device("c", (4.8, 3.8, 1.2), -140.0),
        Device("d", (0.2, 3.3, 2.2), -40.0),
    ),
)


def verify(workshop: Workshop) -> Group:
    """Traces a furnished room with four devices that all send and hear."""
    rows = []
    for name, radio in (
        ("wifi, V", single(preset("wifi"))),
        ("wifi, H", single(preset("wifi"), polarization="H")),
        ("60–64 GHz, V", single(preset("mmwave"), num_subcarriers=64)),
    ):
        rows.append(_row(f"{name}, csi_static, worst of 6 pairs", _static(workshop, radio)))
    radio = replace(single(preset("wifi")), num_subcarriers=16)
    rows.append(_row("wifi, a person inside, worst of 6 pairs", _frame(workshop, radio)))
    return Group(
        "reciprocity",
        "Reciprocity in a furnished room",
        "A room of plasterboard with a wooden table, a metal cabinet and a pane of glass; four "
        "devices, each pair in both directions. With a person: depth 2, shadows and echoes by way "
        "of walls.",
        rows,
    )


def _static(workshop: Workshop, radio: Radio) -> np.ndarray:
    return workshop.traced(workshop.bundle(FURNISHED), radio, depth=1).static()


def _frame(workshop: Workshop, radio: Radio) -> np.ndarray:
    bundle = workshop.bundle(FURNISHED)
    tracer = workshop.traced(bundle, radio, depth=2)
    return tracer.frame(bundle.frame(2))


def _row(name: str, csi: np.ndarray) -> Row:
    """The pair that differs most from its reverse; `csi` has the shape (tx, rx, subcarrier)."""
    there = csi.astype(np.complex128)
    power = (np.abs(there) ** 2).sum(axis=2)
    error = (np.abs(there - there.transpose(1, 0, 2)) ** 2).sum(axis=2)
    between = ~np.eye(len(power), dtype=bool)
    worst = float((error[between] / power[between]).max())
    return within(name, decibels(worst), WORST_DB, "dB", SOURCE)
