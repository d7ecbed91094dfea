# SPDX-License-Identifier: Apache-2.0
"""What two antennas of one receiver share cancels: conjugate products and ratios."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex


def reference_antenna(values: Complex[np.ndarray, "time rx *any"]) -> int:
    """Antenna that stands still most: the largest mean over time of |H|, in units of its deviation.

    Source: `get_doppler_spectrum.m` of Widar 3.0 (Zheng et al. 2019), mean over standard
    deviation; ports that divide by the variance prefer the weakest antenna.
    """
    level = np.abs(values)
    spread = level.std(axis=0)
    ratio = np.divide(level.mean(axis=0), spread, out=0 * spread, where=spread > 0)
    return int(ratio.reshape(values.shape[1], -1).mean(axis=1).argmax())


def adjust_amplitudes(
    values: Complex[np.ndarray, "time rx *any"], reference: int
) -> Complex[np.ndarray, "time rx *any"]:
    """Shifts amplitudes so that conjugate products tell approaching from receding.

    IndoTrack (Li et al. 2017) as Widar 3.0 does it: with a the mirror ambiguity comes from the
    term of the static path of the other antenna, so each antenna loses α = its least amplitude,
    and the reference gains β = 1000 Σα / antennas: |H| ← |H| − α, |H_r| ← |H_r| + β.

    Args:
        values: Channels.
        reference: Antenna whose conjugate is taken.
    """
    level, phase = np.abs(values), np.exp(1j * np.angle(values))
    seen = np.where(level > 0, level, np.inf).min(axis=0)
    alpha = np.where(np.isfinite(seen), seen, 0.0)
    beta = 1000.0 * alpha.sum() / max(alpha.size, 1)
    shifted = level - alpha
    shifted[:, reference] = level[:, reference] + beta
    return (shifted * phase).astype(values.dtype)


def conjugate_product(
    values: Complex[np.ndarray, "time rx *any"], reference: int
) -> Complex[np.ndarray, "time other *any"]:
    """H_a H̄_r of every other antenna a with a reference r: phases that both share cancel.

    Source: IndoTrack (Li et al. 2017), equation 4. The absolute delay goes with them.

    Args:
        values: Channels.
        reference: Antenna whose conjugate is taken.
    """
    others = np.delete(values, reference, axis=1)
    return others * np.conj(values[:, reference : reference + 1])


def csi_ratio(
    values: Complex[np.ndarray, "time rx *any"], reference: int, floor: float = 1e-3
) -> Complex[np.ndarray, "time other *any"]:
    """H_a / H_r of every other antenna: shared phases and shared gain cancel.

    Source: FarSense (Zeng et al. 2019), equation 4. Where the reference fades below `floor` of its
    median amplitude the ratio would explode, and is NaN.

    Args:
        values: Channels.
        reference: Antenna to divide by.
        floor: Least amplitude of the reference, relative to its median.
    """
    others = np.delete(values, reference, axis=1)
    below = values[:, reference : reference + 1]
    level = np.abs(below)
    weak = level <= floor * np.median(level)
    ratio = others / np.where(weak, 1.0, below)
    return np.where(np.broadcast_to(weak, ratio.shape), np.nan, ratio)
