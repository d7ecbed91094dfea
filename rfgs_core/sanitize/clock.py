# SPDX-License-Identifier: Apache-2.0
"""Packets of irregular times on one common clock."""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Bool, Complex, Float, Float64

#: nearest keeps what was measured; linear interpolates between packets, for cleaned phases only.
Way = Literal["nearest", "linear"]


def common_clock(
    times_s: list[Float64[np.ndarray, "_time"]], rate_hz: float
) -> Float64[np.ndarray, "tick"]:
    """Ticks at a rate over the time that all radios share.

    Args:
        times_s: Times of each radio's packets on one time axis [s].
        rate_hz: Ticks per second.

    Returns:
        Times of the ticks [s]; empty where the radios share no time.
    """
    first = max(float(row[0]) for row in times_s)
    last = min(float(row[-1]) for row in times_s)
    # A rounding error must not cost the last tick.
    return first + np.arange(int(np.floor((last - first) * rate_hz + 1e-6)) + 1) / rate_hz


def resample(
    values: Complex[np.ndarray, "time *link"] | Float[np.ndarray, "time *link"],
    time_s: Float64[np.ndarray, "time"],
    ticks_s: Float64[np.ndarray, "tick"],
    way: Way = "linear",
    longest_gap_s: float = 0.05,
) -> tuple[np.ndarray, Bool[np.ndarray, "tick"]]:
    """Values at the ticks of a clock, x(t) = ((t₁ − t) x₀ + (t − t₀) x₁) / (t₁ − t₀).

    Args:
        values: Series at the packets' own times.
        time_s: Those times [s], never descending.
        ticks_s: Times wanted [s].
        way: nearest packet, or linear between two of them.
        longest_gap_s: Longest time between the packets on either side of a tick [s].

    Returns:
        Values (tick, *link), and where they can be trusted: not inside a longer gap, nor outside
        of the packets.
    """
    time_s = np.asarray(time_s, np.float64)
    after = np.clip(np.searchsorted(time_s, ticks_s), 1, max(len(time_s) - 1, 1))
    left, right = after - 1, np.minimum(after, len(time_s) - 1)
    span = time_s[right] - time_s[left]
    weight = np.divide(ticks_s - time_s[left], span, out=np.zeros(len(ticks_s)), where=span > 0)
    weight = np.clip(weight, 0.0, 1.0)
    slack = 1e-9 + 1e-6 * longest_gap_s
    inside = (ticks_s >= time_s[0] - slack) & (ticks_s <= time_s[-1] + slack)
    hit = np.minimum(np.abs(ticks_s - time_s[left]), np.abs(ticks_s - time_s[right])) <= slack
    trusted = inside & ((span <= longest_gap_s + slack) | hit)
    if way == "nearest":
        return values[np.where(weight > 0.5, right, left)], trusted
    weight = weight.reshape(-1, *[1] * (values.ndim - 1))
    found = (1.0 - weight) * values[left] + weight * values[right]
    return found.astype(values.dtype), trusted
