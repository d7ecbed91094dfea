# SPDX-License-Identifier: Apache-2.0
"""What everything that moves scatters straight from transmitter to receiver."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.antennas import field, passed_on
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.sites import centres, owners, ports, site_pairs
from rfgs_core.simulate.surface.facets import facet_sum
from rfgs_core.simulate.surface.points import LIFT_M


@dataclass(frozen=True)
class PosedPoints:
    """Scattering points of one frame."""

    positions: np.ndarray
    """On the skin [m], shape (point, 3)."""
    normals: np.ndarray
    """Unit outward normals, shape (point, 3)."""
    areas: np.ndarray
    """Area of each facet [m²], shape (point,)."""
    material: np.ndarray
    """Material index of each point, shape (point,)."""

    @property
    def lifted(self) -> np.ndarray:
        """Positions a millimetre outside the skin [m], to test from there what hides them.

        For visibility alone: a wave scattered there would be half a turn early at 75 GHz.
        """
        return self.positions + LIFT_M * self.normals


def direct_channel(
    points: PosedPoints,
    seen: np.ndarray,
    layout: Layout,
    devices: list[DevicePose],
    gamma: dict[int, np.ndarray],
    radio: Radio,
) -> np.ndarray:
    """Single-bounce channel of the moving points, for every measured link.

    Antenna patterns are taken in the direction between points and the centre of each site;
    distances and facets are exact per element and subcarrier.

    Args:
        points: Scattering points.
        seen: Share of each point that pairs of sites see, as `in_sight` tells, shape
            (tx site, rx site, point).
        layout: Antenna elements.
        devices: Poses of the devices, for pattern and polarisation.
        gamma: Reflection coefficient by material index, each of shape (subcarrier,).
        radio: Gives subcarriers, antenna pattern and polarisation.

    Returns:
        Complex128, shape (tx, rx, subcarrier), zero where a link is not measured.
    """
    positions = points.positions
    tx_centres, rx_centres = centres(layout)
    tx_owner, rx_owner = owners(layout)
    shape = (len(layout.tx_xyz), len(layout.rx_xyz), radio.num_subcarriers)
    out = np.zeros(shape, dtype=np.complex128)
    for (a, b), (i, j) in product(site_pairs(layout), ports(layout)):
        into, out_of = positions - tx_centres[a], rx_centres[b] - positions
        tx_axes, rx_axes = (
            rotation(devices[owner].quat_wxyz) for owner in (tx_owner[a], rx_owner[b])
        )
        sent = field(radio.pattern, radio.slants_deg[i], into, tx_axes)
        heard = field(radio.pattern, radio.slants_deg[j], -out_of, rx_axes)
        factor = seen[a, b] * passed_on(into, out_of, sent, heard)
        tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == i))
        rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == j))
        for material, coefficient in gamma.items():
            weights = np.where(points.material == material, factor, 0.0)
            part = facet_sum(
                positions,
                points.normals,
                points.areas,
                layout.tx_xyz[tx],
                layout.rx_xyz[rx],
                weights,
                radio.freq_hz,
            )
            out[np.ix_(tx, rx)] += part * coefficient
    return out
