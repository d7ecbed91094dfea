# SPDX-License-Identifier: Apache-2.0
"""The likeliest walk through a sequence: one gait, one rate, and places that follow each other.

A frame alone leaves ten poses within the doubt of the model; a person who walks goes through
their stride at a steady rate and does not jump. The likeliest path is that of Viterbi (IEEE
Transactions on Information Theory 13(2), 1967), for every rate that strides have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

#: Phases between which paths are told apart; evidence is interpolated.
FINE = 36
#: Rates that are tried, against that of the stride.
_RATES = np.linspace(0.7, 1.4, 15)
#: A phase strays from its rate by this much in a tenth of a second [rad].
_STRAYS_RAD = 0.12
#: A place strays from where it was beside the track by this much in a tenth of a second, and is
#: this far from the track [m].
_STRAYS_M, _OFF_TRACK_M = 0.015, 0.05


class Path(NamedTuple):
    """Phases and places through a sequence."""

    score: float
    """Log evidence and log prior [nat]."""
    phase: Float64[np.ndarray, "frame"]
    """Share of the stride that has passed."""
    shift: Int64[np.ndarray, "frame"]
    """Which of the places."""


def walked(
    log: Float64[np.ndarray, "frame phase shift"],
    shifts: Float64[np.ndarray, "shift 3"],
    time_s: Float64[np.ndarray, "frame"],
    stride_s: float,
) -> Path:
    """The likeliest walk.

    Args:
        log: Evidence of each frame at equal phases of a stride and at some places [nat].
        shifts: Places against the track [m].
        time_s: When frames were taken [s].
        stride_s: How long the stride lasts where its rate is the ordinary one [s].
    """
    fine = _finer(log)
    paths = [_best(fine, shifts, time_s, rate / stride_s) for rate in _RATES]
    return max(paths, key=lambda path: path.score)


def stood(
    log: Float64[np.ndarray, "frame shift"],
    shifts: Float64[np.ndarray, "shift 3"],
    time_s: Float64[np.ndarray, "frame"],
) -> Path:
    """The likeliest places of a pose that stays as it is."""
    return _best(log[:, None], shifts, time_s, 0.0)


def off_track(shifts: Float64[np.ndarray, "shift 3"]) -> Float64[np.ndarray, "shift"]:
    """What the prior takes from the evidence of places beside the track [nat]."""
    return 0.5 * np.sum(shifts**2, axis=1) / _OFF_TRACK_M**2


def _finer(log: np.ndarray) -> np.ndarray:
    """Evidence between phases, linear around the stride."""
    count = log.shape[1]
    at = np.arange(FINE) * count / FINE
    low = at.astype(int)
    share = (at - low)[:, None]
    return (1.0 - share) * log[:, low] + share * log[:, (low + 1) % count]


def _best(log: np.ndarray, shifts: np.ndarray, time_s: np.ndarray, rate_hz: float) -> Path:
    """The likeliest path at one rate [strides/s]."""
    frames, phases = log.shape[:2]
    gained = log - off_track(shifts)
    jump_m2 = np.sum((shifts[:, None] - shifts) ** 2, axis=2)
    turn = np.arange(phases) / phases
    total = gained[0]
    back: list[tuple[np.ndarray, np.ndarray]] = []
    for frame in range(1, frames):
        elapsed = float(time_s[frame] - time_s[frame - 1])
        off = turn - turn[:, None] - elapsed * rate_hz
        off = 2.0 * np.pi * (off - np.round(off))
        steps = max(elapsed / 0.1, 1e-3)
        by_phase = -0.5 * off**2 / (_STRAYS_RAD**2 * steps)
        by_place = -0.5 * jump_m2 / (_STRAYS_M**2 * steps)
        from_place = total[:, :, None] + by_place
        place, total = from_place.argmax(axis=1), from_place.max(axis=1)
        from_phase = total[:, None] + by_phase[:, :, None]
        phase, total = from_phase.argmax(axis=0), from_phase.max(axis=0)
        back.append((phase, place))
        total = total + gained[frame]
    at = np.unravel_index(int(total.argmax()), total.shape)
    phase_of, place_of = [int(at[0])], [int(at[1])]
    for phase, place in reversed(back):
        before = int(phase[phase_of[-1], place_of[-1]])
        phase_of.append(before)
        place_of.append(int(place[before, place_of[-1]]))
    # A pose that stays has a single phase, whatever the rate.
    return Path(float(total.max()), np.array(phase_of[::-1]) / phases, np.array(place_of[::-1]))
