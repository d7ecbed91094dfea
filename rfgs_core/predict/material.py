# SPDX-License-Identifier: Apache-2.0
"""What the echo's level over frequency says about the material, and how little that may be.

A large opaque body of surface S has, averaged over aspects, the radar cross-section |R|² S/4
(geometric optics), with R the reflection of its material at normal incidence. Level and slope
also depend on size and shape, which are known only roughly, so with f₀ the geometric mean of the
frequencies

    10 log10 σ(f) = 20 log10 |R(f)| + 10 log10(S/4) + a + n 10 log10(f/f₀) + e(f),

a ~ N(0, LEVEL_DB²), n ~ N(0, SLOPE²), e speckle. All are normal, so the likelihood of each
material is closed. One narrow band shows the level alone, and materials of equal |R| cannot be
separated: weights say so by being alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float64

from rfgs_core.predict.prediction import subcarriers_of
from rfgs_core.propagation import Links, RadioGaussians, propagate
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import amplitude_decibels, decibels
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.reflection import slab_reflection

#: How well size and posture of the body are known [dB], and the exponent of its shape's slope.
LEVEL_DB, SLOPE = 4.0, 0.3
#: Bands narrower than this against their centre show one level, wider ones four.
NARROW = 0.1
WIDE_LEVELS = 4
#: A material is named when it is this much likelier than the next.
CLEAR_RATIO = 3.0
#: Elements of each device pair that the level is averaged over, at most.
LOOKS_PER_PAIR = 16


@dataclass(frozen=True)
class Levels:
    """Radar cross-section of what moves, over frequency."""

    freq_hz: Float64[np.ndarray, "level"]
    """Frequencies [Hz]."""
    rcs_m2: Float64[np.ndarray, "level"]
    """Mean radar cross-section over the links [m²]."""
    speckle_db: Float64[np.ndarray, "level"]
    """Standard deviation of that mean [dB]."""

    @staticmethod
    def join(parts: Sequence[Levels]) -> Levels:
        """Levels of several bands."""
        names = ("freq_hz", "rcs_m2", "speckle_db")
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return Levels(**joined)


def levels_of(
    gaussians: RadioGaussians, layout: Layout, freq_hz: Float[np.ndarray, "subcarrier"]
) -> Levels | None:
    """Radar cross-section of the Gaussians together, averaged over a radio's monostatic links.

    Each device counts as one independent look: the elements of an array see nearly the same
    speckle. Between devices a body's mean cross-section is not that of backscatter, which the
    model above is about.

    Returns:
        None where no device hears itself.
    """
    pairs = [(a, b) for a, b in layout.device_pairs if a == b]
    if not pairs:
        return None
    rows = [_some_links(layout, a, b) for a, b in pairs]
    tx, rx = np.concatenate(rows, axis=1)
    links = Links(torch.from_numpy(layout.tx_xyz[tx]), torch.from_numpy(layout.rx_xyz[rx]))
    with torch.no_grad():
        csi = propagate(gaussians, links, subcarriers_of(freq_hz))
    centre = gaussians.means.detach().numpy().mean(axis=0)
    spread = np.linalg.norm(layout.tx_xyz[tx] - centre, axis=1)
    spread *= np.linalg.norm(layout.rx_xyz[rx] - centre, axis=1)
    # The radar equation backwards, per entry.
    factor = (4 * np.pi) ** 3 * spread[:, None] ** 2 / (SPEED_OF_LIGHT / freq_hz) ** 2
    rcs_m2 = (np.abs(csi.numpy().astype(np.complex128)) ** 2 * factor).mean(axis=0)
    wide = (freq_hz[-1] - freq_hz[0]) / np.mean(freq_hz) >= NARROW
    parts = np.array_split(np.arange(len(freq_hz)), WIDE_LEVELS if wide else 1)
    # The mean of n independent exponential powers varies by 1/√n.
    speckle_db = 10 / np.log(10) / np.sqrt(len(pairs))
    return Levels(
        freq_hz=np.array([freq_hz[part].mean() for part in parts]),
        rcs_m2=np.array([rcs_m2[part].mean() for part in parts]),
        speckle_db=np.full(len(parts), speckle_db),
    )


def material_weights(levels: Levels, surface_m2: float) -> dict[str, float]:
    """Posterior weight of each radio material that is known at all frequencies.

    Args:
        levels: Cross-sections over frequency.
        surface_m2: Surface of the body [m²].

    Returns:
        Weights that sum to one, falling; equal before the data.
    """
    freq_hz = levels.freq_hz
    known = [
        material.name
        for material in MATERIALS.values()
        if (freq_hz >= material.freq_min_hz).all() and (freq_hz <= material.freq_max_hz).all()
    ]
    found_db = decibels(levels.rcs_m2)
    slope_db = decibels(freq_hz / np.exp(np.log(freq_hz).mean()))
    cov = np.diag(levels.speckle_db**2) + LEVEL_DB**2 + SLOPE**2 * np.outer(slope_db, slope_db)
    score = []
    for name in known:
        own_db = amplitude_decibels(np.abs(slab_reflection(name, freq_hz)))
        off_db = found_db - own_db - decibels(surface_m2 / 4)
        score.append(-0.5 * off_db @ np.linalg.solve(cov, off_db))
    weight = np.exp(np.array(score) - max(score))
    weight /= weight.sum()
    order = np.argsort(-weight, kind="stable")
    return {known[index]: float(weight[index]) for index in order}


def material_sentence(levels: Levels, weights: dict[str, float]) -> str:
    """What can be said of the material, in one sentence."""
    rows = list(weights.items())
    best = rows[0][1]
    alike = [f"{name} ({weight:.0%})" for name, weight in rows if weight * CLEAR_RATIO > best]
    if len(alike) == 1:
        return f"reflects like {alike[0]}; only level and frequency slope were compared"
    ground = "one level" if len(levels.freq_hz) == 1 else f"{len(levels.freq_hz)} levels"
    return f"cannot be told from {ground} over frequency; about equally likely: {', '.join(alike)}"


def _some_links(layout: Layout, a: int, b: int) -> np.ndarray:
    """Some measured links of a device pair, spread over its elements; rows tx and rx."""
    links = np.stack(np.nonzero(layout.measured & layout.links_between(a, b)))
    chosen = np.linspace(0, links.shape[1] - 1, min(LOOKS_PER_PAIR, links.shape[1])).astype(int)
    return links[:, chosen]
