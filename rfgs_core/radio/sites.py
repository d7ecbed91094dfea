# SPDX-License-Identifier: Apache-2.0
"""Sites of antennas: what one place sends or hears with, traced from its centre."""

from __future__ import annotations

import numpy as np

from rfgs_core.radio.layout import Layout


def centres(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the TX and RX sites [m], each of shape (site, 3)."""
    tx = [layout.tx_xyz[layout.tx_site == i].mean(axis=0) for i in range(layout.tx_site.max() + 1)]
    rx = [layout.rx_xyz[layout.rx_site == i].mean(axis=0) for i in range(layout.rx_site.max() + 1)]
    return np.stack(tx), np.stack(rx)


def owners(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Device of each TX and of each RX site."""
    _, tx = np.unique(layout.tx_site, return_index=True)
    _, rx = np.unique(layout.rx_site, return_index=True)
    return layout.tx_device[tx], layout.rx_device[rx]


def ports(layout: Layout) -> list[tuple[int, int]]:
    """Pairs of a transmitting and a receiving polarisation port, transmitting first."""
    tx, rx = np.unique(layout.tx_port), np.unique(layout.rx_port)
    return [(int(i), int(j)) for i in tx for j in rx]


def site_pairs(layout: Layout) -> list[tuple[int, int]]:
    """Pairs of a transmitting and a receiving site that have a measured link."""
    links = np.argwhere(layout.measured)
    pairs = np.stack([layout.tx_site[links[:, 0]], layout.rx_site[links[:, 1]]], axis=1)
    return [(int(a), int(b)) for a, b in np.unique(pairs, axis=0)]


def measured_pairs(layout: Layout) -> np.ndarray:
    """Which pairs of a transmitting and a receiving site have a measured link, bool."""
    wanted = np.zeros((layout.tx_site.max() + 1, layout.rx_site.max() + 1), dtype=bool)
    links = np.argwhere(layout.measured)
    wanted[layout.tx_site[links[:, 0]], layout.rx_site[links[:, 1]]] = True
    return wanted
