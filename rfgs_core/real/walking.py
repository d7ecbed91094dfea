# SPDX-License-Identifier: Apache-2.0
"""Intel 5300: the Doppler shifts of somebody who walks, and those of the same radio's noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from rfgs_core import sanitize
from rfgs_core.capture import Capture, read_capture

#: Rates of change of a path's length that a walking body and its limbs cause [m/s].
WALKING_M_S = (0.5, 3.0)
#: Wavelength [m]; the file does not tell its channel, but its antennas turn against each other by
#: quarter turns, as the card's do at 2.4 GHz alone.
_WAVELENGTH_M = 0.123


def judge_walking(path: Path) -> dict[str, float | str]:
    """Share of the Doppler power that lies in the band of walking, by three ways.

    `raw`: packets as reported; `amplitude`: without phases; `ours`: conjugate products of antennas
    with adjusted amplitudes. `shuffled` is ours on packets in random order, which holds no motion:
    what it shows is the share of noise.

    Returns:
        Shares, and the median speed at which the path changes by ours [m/s].
    """
    capture = read_capture(path).largest
    values, rate_hz = _on_a_clock(capture)
    generator = np.random.default_rng(0)
    shuffled = values[generator.permutation(len(values))]
    ways = {
        "raw": values.reshape(len(values), -1),
        "amplitude": np.abs(values).reshape(len(values), -1) + 0j,
        "shuffled": _products(shuffled),
        "ours": _products(values),
    }
    result: dict[str, float | str] = {}
    for name, links in ways.items():
        speed_m_s, power = _speeds(links, rate_hz)
        band = (speed_m_s >= WALKING_M_S[0]) & (speed_m_s <= WALKING_M_S[1])
        result[f"{name}_share"] = float(power[band].sum() / power.sum())
        if name == "ours":
            total = power.sum(axis=1).cumsum()
            result["ours_median_m_s"] = float(speed_m_s[np.searchsorted(total, 0.5 * total[-1])])
    return result


def _on_a_clock(capture: Capture) -> tuple[Complex[np.ndarray, "time rx bin"], float]:
    """Packets of antennas that heard something, at their own mean rate."""
    used = np.flatnonzero(capture.valid[:, 0].any(axis=(0, 2, 3)))
    values = sanitize.undo_quarter_turns(capture.values[:, 0, used, 0].astype(np.complex128))[0]
    rate_hz = capture.rate_hz
    ticks_s = sanitize.common_clock([capture.time_s], rate_hz)
    return sanitize.resample(values, capture.time_s, ticks_s, "nearest")[0], rate_hz


def _products(values: Complex[np.ndarray, "time rx bin"]) -> Complex[np.ndarray, "time link"]:
    """Products of every antenna with the steadiest."""
    reference = sanitize.reference_antenna(values)
    adjusted = sanitize.adjust_amplitudes(values, reference)
    return sanitize.conjugate_product(adjusted, reference).reshape(len(values), -1)


def _speeds(
    links: Complex[np.ndarray, "time link"], rate_hz: float
) -> tuple[Float[np.ndarray, "speed"], Float[np.ndarray, "speed slice"]]:
    """Power over speed (either way) and time, without what stands still."""
    high_hz = 0.45 * rate_hz
    kept = sanitize.doppler_band(links, rate_hz, 2.0, high_hz)
    freq_hz, _, power = sanitize.doppler_spectrum(
        sanitize.first_component(kept), rate_hz, window_s=0.5
    )
    half = len(freq_hz) // 2
    folded = power[half:].copy()
    folded[1:] += power[:half][::-1]
    return freq_hz[half:] * _WAVELENGTH_M, folded
