# SPDX-License-Identifier: Apache-2.0
"""Density that follows motion: a body that moves has more Gaussians than one that stands.

The pace of a body is measured, by the speed of its track and by how much of the channel's change
is another one than in the frame before. A track trembles by the error of its places even where
somebody stands; the change then stays the same, and the pace is next to nothing. Between frames
Gaussians are drawn or dropped until their number suits the pace.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

from rfgs_core.bodies.tracks import Tracks
from rfgs_core.measure.observations import Observations

#: Pace at which a body has its share of the Gaussians asked for [m/s].
WALK_M_S = 1.0
#: Share of that share which a standing body keeps, and how often it the fastest has.
LEAST, MOST = 0.25, 2.0


def novelty(now: Observations, before: Observations) -> float:
    """How much of the channel's change is new: |Δ − Δ'|² / (|Δ|² + |Δ'|²), at most 1.

    0 where nothing has moved, 1 where the changes of the frames have nothing in common. Of powers
    per delay the amplitudes of the change are compared. Only links that both frames have count.
    """
    both = (now.links & before.links)[..., None]
    new, old = (
        np.where(both, frame.delta if frame.delay_change is None else frame.delay_change, 0)
        for frame in (now, before)
    )
    power = _power(new) + _power(old)
    return min(1.0, _power(new - old) / power) if power > 0 else 0.0


def _power(values: np.ndarray) -> float:
    return float(np.sum(np.abs(values).astype(np.float64) ** 2))


def speeds_m_s(tracks: Tracks, new: float) -> Float64[np.ndarray, "body"]:
    """Pace of each body: its speed times the novelty; that of a walk before speeds are known."""
    speed_m_s = np.linalg.norm(tracks.velocity_xy, axis=1)
    return np.where(np.isfinite(speed_m_s), speed_m_s * new, WALK_M_S)


def wanted_counts(
    num_gaussians: int, speed_m_s: Float[np.ndarray, "body"]
) -> Int64[np.ndarray, "body"]:
    """How many Gaussians each body shall have.

    Linear in the pace, from `LEAST` at rest over 1 at `WALK_M_S` to at most `MOST`, times an
    equal part of `num_gaussians`; at least one.
    """
    factor = np.clip(LEAST + (1 - LEAST) * speed_m_s / WALK_M_S, LEAST, MOST)
    return np.maximum(1, np.round(factor * num_gaussians / len(speed_m_s))).astype(np.int64)


def kept(
    body: Int64[np.ndarray, "M"],
    power: Float[np.ndarray, "M"],
    wanted: Int64[np.ndarray, "body"],
) -> Bool[np.ndarray, "M"]:
    """Which Gaussians stay where a body has more than wanted: those that reflect most.

    Args:
        body: Body of each.
        power: Reflected power of each; nothing where it is new.
        wanted: Most of each body.
    """
    keep = np.zeros(len(body), dtype=bool)
    for index, count in enumerate(wanted):
        own = np.flatnonzero(body == index)
        keep[own[np.argsort(-power[own], kind="stable")[:count]]] = True
    return keep
