# SPDX-License-Identifier: Apache-2.0
"""A closed box room against its image sources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.verify.card import Curve, Group, Plot, Row, within
from dataset_factory.verify.closed_forms import C, db, error_db
from dataset_factory.verify.description import MARKER, Description, Device, room, stepping
from dataset_factory.verify.images import Box, box_channel, delays_s
from dataset_factory.verify.tracing import Links, single, static_links
from dataset_factory.verify.workshop import Workshop, devices_of
from rfgs_core.radio import Radio, preset

#: Error power of csi_static over that of the closed form [dB]; of whole arrays, whose elements
#: share the angles of their centre, as section 7 of docs/dataset.md has it.
ERROR_DB, ARRAY_DB = -40.0, -25.0
#: Largest error of a delay, as a length [m].
DELAY_M = 1e-4
CONCRETE = Box((4.0, 3.0, 2.5), "concrete", 0.2)
PLASTERBOARD = Box((4.0, 3.0, 2.5), "plasterboard", 0.0125)
SOURCE = "image sources (Allen and Berkley 1979), slabs of ITU-R P.2040-3 eq. 42, 43"


def scene(box: Box) -> Description:
    """A box with two devices in it, twice, as long arrays need their own."""
    devices = tuple(
        Device(f"{radio} {end}", place, yaw_deg, radio=radio)
        for radio in ("any", "uwb")
        for end, place, yaw_deg in (("a", (0.6, 0.7, 1.2), 30.0), ("b", (3.1, 2.2, 1.9), -150.0))
    )
    walls = room(box.size_m, box.material, box.thickness_m)
    return Description((*walls, stepping(MARKER, [(2.0, 1.4, 0.4), (2.2, 1.4, 0.4)])), devices)


def verify(workshop: Workshop, built: Box = CONCRETE) -> Group:
    """Traces boxes of concrete and plasterboard.

    Args:
        workshop: Where scenes are built.
        built: The box of concrete that is built; `CONCRETE` is what it is compared with.
    """
    rows, plots = [], []
    wifi, commodity = single(preset("wifi")), preset("wifi_commodity")
    mmwave = single(preset("mmwave"))
    uwb = single(preset("uwb"), rx_spacing_m=0.0)
    cases = [
        ("concrete, wifi, V", built, CONCRETE, wifi, ERROR_DB),
        ("concrete, wifi, H", built, CONCRETE, replace(wifi, polarization="H"), ERROR_DB),
        ("plasterboard, wifi, V", PLASTERBOARD, PLASTERBOARD, wifi, ERROR_DB),
        (
            "plasterboard, wifi, H",
            PLASTERBOARD,
            PLASTERBOARD,
            replace(wifi, polarization="H"),
            ERROR_DB,
        ),
        ("concrete, 60–64 GHz, V", built, CONCRETE, mmwave, ERROR_DB),
        ("concrete, 60–64 GHz, H", built, CONCRETE, replace(mmwave, polarization="H"), ERROR_DB),
        ("concrete, 3.1–10.6 GHz, V", built, CONCRETE, uwb, ERROR_DB),
        ("plasterboard, 3.1–10.6 GHz, V", PLASTERBOARD, PLASTERBOARD, uwb, ERROR_DB),
        ("concrete, arrays of wifi_commodity, V", built, CONCRETE, commodity, ARRAY_DB),
        ("concrete, arrays of wifi, V", built, CONCRETE, preset("wifi"), ARRAY_DB),
    ]
    for name, made, box, radio, limit_db in cases:
        bundle = workshop.bundle(scene(made))
        found = static_links(workshop, bundle, radio)
        exact = _exact(box, radio, found)
        error = error_db(found.channel[~found.steep], exact[~found.steep])
        rows.append(within(f"{name}, error power", error, limit_db, "dB", SOURCE))
        if name.startswith("concrete, wifi") or "plasterboard, 3" in name:
            plots.append(_plot(name, radio, found, exact))
    rows += _delays(workshop, built, wifi)
    return Group(
        "box",
        "A closed box: image sources with ITU slabs",
        "A room of 4 × 3 × 2.5 m, six slabs of concrete (20 cm) or plasterboard (12.5 mm), two "
        "isotropic antennas. csi_static over the whole band beside the sum over all 63 image "
        "sources of up to three reflections, TE and TM at each wall.",
        rows,
        plots,
    )


def _exact(box: Box, radio: Radio, found: Links) -> np.ndarray:
    """Closed forms of links, shape (link, subcarrier)."""
    ends = zip(found.tx_xyz, found.rx_xyz, strict=True)
    return np.stack([box_channel(box, t, r, radio.freq_hz, radio.polarization) for t, r in ends])


def _delays(workshop: Workshop, built: Box, radio: Radio) -> list[Row]:
    """Number and delays of the paths from one device to the other."""
    bundle = workshop.bundle(scene(built))
    devices = devices_of(bundle, radio)
    found = workshop.traced(bundle, radio, devices, depth=1).static_delays_s(0, 1)
    tx, rx = (np.array(device.position_m) for device in devices[:2])
    exact = delays_s(CONCRETE, tx, rx)
    count = Row(
        "paths of up to three reflections",
        str(len(exact)),
        str(len(found)),
        float(abs(len(found) - len(exact))),
        0.0,
        "",
        "image sources",
    )
    off_mm = np.inf
    if len(found) == len(exact):
        off_mm = 1e3 * C * float(np.abs(found - exact).max())
    return [count, within("their delays, worst", off_mm, 1e3 * DELAY_M, "mm", "image sources")]


def _plot(name: str, radio: Radio, found: Links, exact: np.ndarray) -> Plot:
    freq_ghz = radio.freq_hz / 1e9
    curves = [
        Curve("image sources", freq_ghz, db(exact[0]), "closed form"),
        Curve("csi_static", freq_ghz, db(found.channel[0]), "measured"),
    ]
    return Plot(name, "frequency [GHz]", "|H| [dB]", curves)
