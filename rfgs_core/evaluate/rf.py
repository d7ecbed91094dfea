# SPDX-License-Identifier: Apache-2.0
"""How well channel entries that training never saw are predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from rfgs_core.dataset.splits import HeldOut
from rfgs_core.radio import Layout
from rfgs_core.radio.delay import delay_profile, hann
from rfgs_core.radio.levels import decibels

#: Metrics of the RF group and, where it exists, the median over frames beside the pooled value.
RF_KEYS = ("element_snr_db", "subcarrier_snr_db", "device_gain_mae_db", "delay_profile_corr")
#: Ratio under which a power counts as nothing, far below single precision [ratio].
NEGLIGIBLE = 1e-14


def snr_db(error_power: float, power: float) -> float | None:
    """10 log10(Σ|true|² / Σ|true − predicted|²) [dB]; None where nothing is to be predicted."""
    if power <= 0.0:
        return None
    return float(decibels(power / max(error_power, NEGLIGIBLE * power)))


def _correlation(
    true: Float[np.ndarray, "link delay"], predicted: Float[np.ndarray, "link delay"]
) -> float | None:
    """Mean over links of the Pearson correlation of profiles; a flat prediction gives None."""
    a = true - true.mean(axis=1, keepdims=True)
    b = predicted - predicted.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    if len(true) == 0 or not (norm > 0.0).any():
        return None
    return float(np.mean(np.sum(a * b, axis=1) / np.maximum(norm, 1e-300)))


def frame_rf(
    true: Complex[np.ndarray, "tx rx subcarrier"],
    predicted: Complex[np.ndarray, "tx rx subcarrier"],
    held_out: HeldOut,
    layout: Layout,
) -> dict[str, Any]:
    """Sums and values of one frame, to be pooled by `pool_rf`.

    Args:
        true: Channel of the frame.
        predicted: Prediction of the same entries.
        held_out: Entries to compare.
        layout: Antenna elements, whose devices make the pairs.

    Returns:
        For `element` and `subcarrier` the pair (error power, power); `gain_db`, the absolute
        differences of mean power per ordered held-out device pair [dB], None where nothing is
        predicted; `delay_profile_corr` over the links of held-out elements and pairs.
    """
    result: dict[str, Any] = {}
    for name in ("element", "subcarrier"):
        where = getattr(held_out, name)
        error = np.abs(true[where] - predicted[where]).astype(np.float64)
        power = np.abs(true[where]).astype(np.float64)
        result[name] = (float(np.sum(error**2)), float(np.sum(power**2)))
    result["gain_db"] = _gain_errors_db(true, predicted, held_out, layout)
    links = held_out.pair_links | held_out.element_links
    result["delay_profile_corr"] = _correlation(
        *(np.abs(delay_profile(csi[links], hann(csi.shape[2]))) for csi in (true, predicted))
    )
    return result


def _gain_errors_db(
    true: Complex[np.ndarray, "tx rx subcarrier"],
    predicted: Complex[np.ndarray, "tx rx subcarrier"],
    held_out: HeldOut,
    layout: Layout,
) -> list[float | None]:
    """Absolute difference of mean power per ordered held-out device pair [dB]."""
    gains: list[float | None] = []
    for a in np.unique(layout.tx_device):
        for b in np.unique(layout.rx_device):
            links = held_out.pair_links & layout.links_between(int(a), int(b))
            if not links.any():
                continue
            want = float(np.mean(np.abs(true[links]).astype(np.float64) ** 2))
            got = float(np.mean(np.abs(predicted[links]).astype(np.float64) ** 2))
            if want > 0.0:
                gains.append(abs(float(decibels(got / want, least=0.0))) if got > 0.0 else None)
    return gains


def rf_values(frame: Mapping[str, Any]) -> dict[str, float | None]:
    """The RF group of a single frame out of `frame_rf`."""
    return {key: value for key, value in pool_rf([frame]).items() if key in RF_KEYS}


def pool_rf(frames: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """The RF group over frames.

    Signal-to-noise ratios are pooled (one ratio of sums over all frames) and their medians
    over frames stand beside them as `element_snr_median_db` and `subcarrier_snr_median_db`.
    Gains are averaged over (device pair, frame), correlations over frames. A value is None
    where nothing was held out or nothing is predicted.
    """
    result: dict[str, float | None] = {}
    for name in ("element", "subcarrier"):
        totals = np.sum([frame[name] for frame in frames], axis=0)
        result[f"{name}_snr_db"] = snr_db(float(totals[0]), float(totals[1]))
        single = [snr_db(*frame[name]) for frame in frames]
        known = [value for value in single if value is not None]
        result[f"{name}_snr_median_db"] = float(np.median(known)) if known else None
    gains = [gain for frame in frames for gain in frame["gain_db"]]
    predicted = [gain for gain in gains if gain is not None]
    # One pair without a prediction has an infinite error, and with it the mean.
    complete = bool(gains) and len(predicted) == len(gains)
    result["device_gain_mae_db"] = float(np.mean(predicted)) if complete else None
    corr = [frame["delay_profile_corr"] for frame in frames]
    known = [value for value in corr if value is not None]
    result["delay_profile_corr"] = float(np.mean(known)) if len(known) == len(corr) else None
    return result
