# SPDX-License-Identifier: Apache-2.0
"""Antennas at given places, without a preset."""

from __future__ import annotations

import numpy as np

from rfgs_core.radio import Layout


def one_device(tx_xyz: np.ndarray, rx_xyz: np.ndarray) -> Layout:
    """Transmitting and receiving elements [m] of one upright device, every link measured."""
    tx, rx = (np.zeros(len(xyz), np.int64) for xyz in (tx_xyz, rx_xyz))
    upright = [np.tile([1.0, 0.0, 0.0, 0.0], (len(xyz), 1)) for xyz in (tx_xyz, rx_xyz)]
    measured = np.ones((len(tx), len(rx)), bool)
    return Layout(tx_xyz, rx_xyz, tx, rx, rx, measured, tx, rx, tx, rx, *upright)
