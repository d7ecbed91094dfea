# SPDX-License-Identifier: Apache-2.0
"""Which scattering points antennas see, by Sionna's own ray test."""

from __future__ import annotations

from typing import Any

import numpy as np

from dataset_factory.trace.rays.scene import visible
from rfgs_core.radio import Layout
from rfgs_core.radio.sites import centres
from rfgs_core.simulate.surface.direct import PosedPoints


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
