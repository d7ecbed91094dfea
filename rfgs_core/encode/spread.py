# SPDX-License-Identifier: Apache-2.0
"""Whether features still tell points apart, or have collapsed to the same few numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

#: Collapsed below this standard deviation over points, relative to the RMS of ‖φ‖ …
LEAST_DEVIATION = 0.1
#: … or below this effective number of dimensions; sub-bands of a narrow band reach 1.2.
LEAST_RANK = 1.1


@dataclass(frozen=True)
class FeatureSpread:
    """How far features vary from point to point."""

    deviation: float
    """Root of the total variance over points, divided by the RMS of ‖φ‖; 0 where φ is constant."""
    rank: float
    """Exponential of the entropy of the covariance's normalised eigenvalues, 1 to 32 (Roy &
    Vetterli, EUSIPCO 2007); 0 where φ is constant."""

    @property
    def collapsed(self) -> bool:
        """Whether the features are too alike to be of use."""
        return self.deviation < LEAST_DEVIATION or self.rank < LEAST_RANK

    @staticmethod
    def of(features: Float[np.ndarray, "N feature"]) -> FeatureSpread:
        """Spread of features over points."""
        values = np.asarray(features, dtype=np.float64)
        energy = float(np.mean(np.sum(values**2, axis=1)))
        variance = np.linalg.eigvalsh(np.cov(values, rowvar=False, bias=True)).clip(min=0.0)
        # Below the rounding of single precision nothing varies.
        if variance.sum() <= 1e-12 * energy or energy == 0.0:
            return FeatureSpread(0.0, 0.0)
        share = variance / variance.sum()
        entropy = -np.sum(share * np.log(np.where(share > 0.0, share, 1.0)))
        return FeatureSpread(float(np.sqrt(variance.sum() / energy)), float(np.exp(entropy)))
