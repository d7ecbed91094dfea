# SPDX-License-Identifier: Apache-2.0
"""FISTA: the few points whose echoes explain all device pairs at once.

Least squares with a penalty on the root mean square of a point's amplitudes over the pairs, so
that pairs agree on which points there are (group lasso, Yuan and Lin 2006), by the accelerated
proximal gradient of Beck and Teboulle (SIAM J. Imaging Sci. 2, 2009). Every pair is scaled to
the same power.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex64, Float

from rfgs_core.evaluate.baselines.lattice import Lattice, lattice_of, power_at
from rfgs_core.evaluate.evidence import BaselineResult, Evidence

#: The penalty, relative to the one that leaves no point. This and the score by relative powers
#: were chosen on three frames of `corridor`.
PENALTY = 0.2
#: Steps of the proximal gradient.
STEPS = 200


def baseline(evidence: Evidence) -> BaselineResult:
    """Points found by FISTA, shown with a round beam."""
    lattice = lattice_of(evidence)
    if lattice is None:
        return BaselineResult(reason="the frame holds no energy")
    amplitude = few_points(lattice)
    used = np.any(amplitude != 0.0, axis=0)
    power = power_at(lattice, amplitude)[used]
    return lattice.model.result(lattice.points[used], amplitude[:, used], power)


def few_points(lattice: Lattice) -> Complex64[np.ndarray, "pair N"]:
    """Amplitudes of the lattice points on each pair; most points have none at all."""
    heard = lattice.heard
    scale = np.sqrt(lattice.level[heard, None]).astype(np.float32)
    echo, alike = lattice.echo[heard] / scale, lattice.alike[heard]
    # A bound on the largest eigenvalue: no row's sum of magnitudes is less.
    step = 1.0 / np.abs(alike).sum(axis=2).max()
    penalty = step * PENALTY * _size(echo).max()
    found, ahead, momentum = np.zeros_like(echo), np.zeros_like(echo), 1.0
    for _ in range(STEPS):
        before = found
        found = ahead - step * ((alike @ ahead[..., None])[..., 0] - echo)
        found = found * np.maximum(1.0 - penalty / np.maximum(_size(found), 1e-30), 0.0)
        after = (1.0 + np.sqrt(1.0 + 4.0 * momentum**2)) / 2.0
        ahead = (found + (momentum - 1.0) / after * (found - before)).astype(np.complex64)
        momentum = after
    amplitude = np.zeros_like(lattice.echo)
    amplitude[heard] = found * scale
    return amplitude


def _size(amplitude: Complex64[np.ndarray, "pair N"]) -> Float[np.ndarray, "N"]:
    """Length of a point's amplitudes over the pairs."""
    return np.linalg.norm(amplitude, axis=0)
