# SPDX-License-Identifier: Apache-2.0
"""Every preset in empty space, at both edges of its band."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, Row, near, within
from dataset_factory.verify.closed_forms import db, friis
from dataset_factory.verify.description import MARKER, Description, Device, stepping
from dataset_factory.verify.tracing import static_links
from dataset_factory.verify.workshop import Workshop
from rfgs_core.radio import PRESETS

#: Largest error of a level [dB] and of a phase [deg] at the edges of a band.
LEVEL_DB, PHASE_DEG = 0.01, 1.0
SOURCE = "Friis (1946)"

#: Two devices, twice: long arrays and antennas that move need their own Empties. What moves is far
#: aside and not in `csi_static`.
SPACE = Description(
    (stepping(MARKER, [(1.0, 4.5, 0.4), (1.2, 4.5, 0.4)]),),
    tuple(
        Device(f"{radio} {end}", place, yaw_deg, radio=radio)
        for radio in ("any", "uwb", "sar")
        for end, place, yaw_deg in (("a", (0.5, 0.6, 1.2), 30.0), ("b", (4.6, 3.1, 2.0), -150.0))
    ),
)


def verify(workshop: Workshop) -> Group:
    """Traces each preset between two devices in empty space."""
    bundle, rows, curves = workshop.bundle(SPACE), [], []
    for name, radio in PRESETS.items():
        if not workshop.traces(radio):
            continue
        if radio.antennas_move:
            radio = replace(radio, samples_per_frame=2)
        found = static_links(workshop, bundle, radio)
        distance = found.distance_m
        ratio = found.channel / friis(radio.freq_hz, distance)
        rows += _rows(name, found.channel, ratio, ~found.steep)
        shown = np.linspace(0, radio.num_subcarriers - 1, 12).astype(int)
        farthest, freq_ghz = int(np.argmax(distance)), radio.freq_hz / 1e9
        exact = db(friis(radio.freq_hz, distance[farthest]))
        curves.append(Curve("" if curves else "Friis", freq_ghz, exact, "closed form"))
        dots = db(found.channel[farthest, shown])
        curves.append(Curve(name, freq_ghz[shown], dots, "measured"))
    plot = Plot("Longest link of each preset", "frequency [GHz]", "|H| [dB]", curves, log_x=True)
    return Group(
        "friis",
        "Free space: Friis at both band edges",
        "Two devices in empty space, every preset as it is: every measured link of every antenna "
        "element, at the lowest and the highest subcarrier. A device whose transmitter hangs "
        "straight below its receivers counts in level only: along the vertical, a vertical "
        "polarisation has no defined sign.",
        rows,
        [plot],
    )


def _rows(name: str, found: np.ndarray, ratio: np.ndarray, level: np.ndarray) -> list[Row]:
    """Level and phase of the worst link at each band edge.

    Args:
        name: The preset.
        found: Channels, shape (link, subcarrier).
        ratio: The same over Friis.
        level: Which links are level enough to have a phase, shape (link,).
    """
    rows = []
    for edge, end in (("lower", 0), ("upper", -1)):
        off_db = db(ratio[:, end])
        worst = int(np.argmax(np.abs(off_db)))
        got = float(db(found[worst, end]))
        exact = got - float(off_db[worst])
        label = f"{name}, {edge} edge, level"
        rows.append(near(label, exact, got, LEVEL_DB, "dB", SOURCE))
        off_deg = np.degrees(np.angle(ratio[level, end]))
        label = f"{name}, {edge} edge, phase error"
        rows.append(within(label, float(np.abs(off_deg).max()), PHASE_DEG, "°", SOURCE))
    return rows
