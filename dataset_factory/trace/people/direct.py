# SPDX-License-Identifier: Apache-2.0
"""What everything that moves scatters straight from transmitter to receiver."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from dataset_factory.trace.people.facets import facet_sum
from dataset_factory.trace.people.points import LIFT_M
from dataset_factory.trace.rays.scene import centres, owners, ports, visible
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.antennas import field, passed_on
from rfgs_core.radio.layout import DevicePose, rotation


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


def in_sight(mi_scene: Any, points: PosedPoints, layout: Layout) -> np.ndarray:
    """Which points every pair of sites sees from both ends.

    Sionna's own ray test from each point to the centre of each site, in the scene with
    everything that moves in place.

    Returns:
        1 where nothing stands between, else 0, shape (tx site, rx site, point).
    """
    lifted = points.lifted
    tx_centres, rx_centres = centres(layout)
    sees_tx = np.stack([visible(mi_scene, lifted, centre) for centre in tx_centres])
    sees_rx = np.stack([visible(mi_scene, lifted, centre) for centre in rx_centres])
    return (sees_tx[:, None] & sees_rx[None]).astype(np.float64)


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


def site_pairs(layout: Layout) -> list[tuple[int, int]]:
    """Pairs of a transmitting and a receiving site that have a measured link."""
    links = np.argwhere(layout.measured)
    pairs = np.stack([layout.tx_site[links[:, 0]], layout.rx_site[links[:, 1]]], axis=1)
    return [(int(a), int(b)) for a, b in np.unique(pairs, axis=0)]
