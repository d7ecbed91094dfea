# SPDX-License-Identifier: Apache-2.0
"""Levels: what automatic gain control did is undone, and a scale that is removed is kept."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Float

from rfgs_core.radio.levels import amplitude_of, power_of


def undo_gain(
    values: Complex[np.ndarray, "time *link bin"], gain_db: Float[np.ndarray, "time"]
) -> Complex[np.ndarray, "time *link bin"]:
    """Divides by the receiver's gain, H ← H / 10^(g/20); apply it once.

    Source: the gain that ESP32-C5/C6 and AGC registers report (ESPARGOS, `csi_processing`).

    Args:
        values: Channels.
        gain_db: Gain at each packet [dB].
    """
    return _by_time(values, amplitude_of(-gain_db))


def scale_to_rssi(
    values: Complex[np.ndarray, "time *link bin"],
    rssi_dbm: Float[np.ndarray, "time"],
    valid: Bool[np.ndarray, "time *link bin"] | None = None,
) -> Complex[np.ndarray, "time *link bin"]:
    """Gives each packet the power that was received, Σ|H|² = 10^(RSSI/10).

    Source: `scale_csi_frame` of CSIKit (Forbes 2021). RSSI comes in steps of 1 dB, so levels jump
    by as much; a packet without RSSI or power becomes zero.

    Args:
        values: Channels.
        rssi_dbm: Received power at each packet [dBm].
        valid: Entries that count; all if None.
    """
    power = np.abs(values) ** 2 * (1.0 if valid is None else valid)
    total = power.reshape(len(values), -1).sum(axis=1)
    wanted = np.where(np.isfinite(rssi_dbm), power_of(np.nan_to_num(rssi_dbm)), 0.0)
    return _by_time(values, np.sqrt(np.divide(wanted, total, out=0 * total, where=total > 0)))


def scale_intel5300(
    values: Complex[np.ndarray, "time rx tx bin"],
    rssi_db: Float[np.ndarray, "time 3"],
    agc_db: Float[np.ndarray, "time"],
    noise_dbm: Float[np.ndarray, "time"],
) -> Complex[np.ndarray, "time rx tx bin"]:
    """Channels of an Intel 5300 in units of √SNR.

    H ← H √(P / (Σ|H|²/30)) / √(N + Q): P = Σ_a 10^(RSSI_a/10) · 10^(−(44 + AGC)/10), N the noise,
    −92 dBm where it was not measured, and Q = P/(Σ|H|²/30) · rx · tx the error of 8-bit numbers;
    then √2 with two streams and 4.5 dB with three. Source: `get_scaled_csi.m` and
    `get_total_rss.m` of dhalperi/linux-80211n-csitool-supplementary.

    Args:
        values: Channels as the card reports them.
        rssi_db: RSSI of each antenna, 0 where there is none.
        agc_db: Gain.
        noise_dbm: Noise, NaN where it was not measured.
    """
    received = np.where(rssi_db > 0, power_of(rssi_db), 0.0).sum(axis=1)
    received = received * power_of(-44.0 - agc_db)
    used = (values != 0).any(axis=(0, 3))
    num_rx, num_tx = int(used.any(axis=1).sum()), int(used.any(axis=0).sum())
    mean = (np.abs(values) ** 2).sum(axis=(1, 2, 3)) / values.shape[-1]
    scale = np.divide(received, mean, out=0 * mean, where=mean > 0)
    noise = power_of(np.where(np.isnan(noise_dbm), -92.0, noise_dbm))
    factor = {2: 2.0**0.5, 3: amplitude_of(4.5)}.get(num_tx, 1.0)
    return _by_time(values, factor * np.sqrt(scale / (noise + scale * num_rx * num_tx)))


def normalise_power(
    values: Complex[np.ndarray, "time *link bin"],
    train: Bool[np.ndarray, "time"] | slice = slice(None),
) -> tuple[Complex[np.ndarray, "time *link bin"], Float[np.ndarray, "*link bin"]]:
    """Divides each link and subcarrier by its RMS over time, H ← H / √⟨|H|²⟩.

    Source: RF-GS, section 3.6. The RMS is that of the training part alone, or held-out frames
    would be known from it; and it is given back, since what weighs links by their strength (w_k of
    equation 5) has nothing left to weigh without it.

    Args:
        values: Channels.
        train: Packets of the training part.

    Returns:
        Channels, and the scale that was removed; 1 where nothing was received.
    """
    scale = np.sqrt(np.mean(np.abs(values[train]) ** 2, axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    return values / scale, scale


def _by_time(values: np.ndarray, factor: Float[np.ndarray, "time"]) -> np.ndarray:
    shaped = factor.reshape(-1, *[1] * (values.ndim - 1))
    return (values * shaped).astype(values.dtype)
