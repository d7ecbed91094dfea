# SPDX-License-Identifier: Apache-2.0
"""Adds to a prediction what it leaves of the visible channel, kriged to hidden entries.

The Gaussians are the mean of a Gaussian process whose covariance is that of the control
`gaussian_process` (regression kriging): physics says what is far from all that was measured, and
neighbouring antennas and tones say what physics has missed. Device pairs without a visible link
keep the prediction.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex

from rfgs_core.evaluate.controls.gaussian_process import krige
from rfgs_core.evaluate.controls.interpolation import fill
from rfgs_core.evaluate.evidence import Evidence

#: Row of the prediction without its residual.
GAUSSIANS_ALONE = "gaussians_alone"


def with_residual(
    predicted: Complex[np.ndarray, "tx rx subcarrier"], evidence: Evidence
) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """The prediction of csi − csi_static with its kriged residual."""
    left = evidence.delta - np.where(np.isnan(evidence.delta), 0.0, predicted)
    residual = fill(left.astype(np.complex64), evidence, krige)
    layout = evidence.layout
    for a, b in layout.device_pairs:
        block = np.ix_(layout.tx_device == a, layout.rx_device == b)
        if not evidence.link_visible[block].any():
            residual[block] = 0.0
    return (predicted + residual).astype(np.complex64)
