# SPDX-License-Identifier: Apache-2.0
"""Several receivers' packets on one clock, cut into frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from rfgs_core.errors import RfgsError
from rfgs_core.sanitize.clock import common_clock, resample

#: Ticks further from both packets around them than this are counted as gaps [s].
LONGEST_GAP_S = 0.05
#: Frames and samples that one sequence may have.
MOST_FRAMES, MOST_TICKS = 100_000, 2**22


@dataclass(frozen=True)
class Schedule:
    """Which packet of each receiver stands for each sample of each frame."""

    fps: float
    """Frames per second."""
    interval_s: float
    """Time between the samples of a frame [s]; 0 of a single one."""
    packet: Int64[np.ndarray, "device frame sample"]
    """The nearest packet of each receiver."""
    time_s: Float64[np.ndarray, "frame sample"]
    """Time of each sample on the common clock [s]."""
    packet_time_s: Float64[np.ndarray, "device frame sample"]
    """Time of the packet that stands for it [s]."""
    trusted: Bool[np.ndarray, "device frame sample"]
    """Whether a packet was near."""


def schedule(
    times_s: list[Float64[np.ndarray, "_time"]], fps: float, rate_hz: float | None
) -> Schedule:
    """Cuts the time that all receivers share into frames of equally spaced samples.

    Samples are packets as they were received, the nearest to each tick: phases of packets are
    not made up.

    Args:
        times_s: Times of each receiver's packets on the common clock [s].
        fps: Frames per second; lowered where packets are fewer.
        rate_hz: Samples per second; None takes the lowest of the receivers' own rates.

    Raises:
        RfgsError: The receivers share no time, one of several has a single packet, or the result
            has too many frames.
    """
    single = [number for number, row in enumerate(times_s, 1) if len(row) < 2]
    if single and len(single) < len(times_s):
        raise RfgsError(
            f"receiver {single[0]} of the layout has a single packet where others have up to "
            f"{max(map(len, times_s))}: leave it out of --layout"
        )
    rates = [_own_rate_hz(row) for row in times_s]
    if min(rates) <= 0 or any(len(row) < 2 for row in times_s):
        first = [np.zeros(1, np.int64) for _ in times_s]
        return _schedule(times_s, first, np.array([max(row[0] for row in times_s)]), 1.0, 1)
    rate_hz = rate_hz or float(min(rates))
    fps = min(fps, rate_hz)
    per_frame = max(int(rate_hz / fps + 1e-6), 1)
    first_s, last_s = max(row[0] for row in times_s), min(row[-1] for row in times_s)
    span_s = float(last_s - first_s)
    if span_s * rate_hz > MOST_TICKS:
        raise RfgsError(
            f"{span_s:.3g} s at {rate_hz:g} Hz are more than {MOST_TICKS} samples; lower rate_hz "
            "in --layout, or cut the captures into pieces"
        )
    ticks_s = common_clock(times_s, rate_hz) if _overlap(times_s) else np.zeros(0)
    # What is shorter than a frame makes one of fewer samples.
    frames, per_frame = (
        max(int(len(ticks_s) * fps / rate_hz + 1e-6), 1),
        min(per_frame, len(ticks_s)),
    )
    if not len(ticks_s):
        spans = "; ".join(f"{row[0]:.3f} to {row[-1]:.3f} s" for row in times_s)
        raise RfgsError(
            f"the receivers share no time: {spans}; give offset_s of each device in --layout"
        )
    if frames > MOST_FRAMES:
        raise RfgsError(
            f"{frames} frames, at most {MOST_FRAMES} make a sequence; lower fps in --layout"
        )
    starts = ticks_s[0] + np.arange(frames) / fps
    wanted = (starts[:, None] + np.arange(per_frame) / rate_hz).ravel()
    nearest = [resample(np.arange(len(row)), row, wanted, "nearest")[0] for row in times_s]
    return _schedule(times_s, nearest, wanted, fps, per_frame)


def _schedule(
    times_s: list[np.ndarray],
    nearest: list[np.ndarray],
    wanted_s: np.ndarray,
    fps: float,
    per_frame: int,
) -> Schedule:
    packet = np.stack(nearest).reshape(len(times_s), -1, per_frame)
    used_s = np.stack([row[which] for row, which in zip(times_s, nearest, strict=True)])
    late = np.abs(used_s - wanted_s)
    wanted_s = wanted_s.reshape(-1, per_frame)
    return Schedule(
        fps=fps,
        interval_s=float(wanted_s[0, 1] - wanted_s[0, 0]) if per_frame > 1 else 0.0,
        packet=packet,
        time_s=wanted_s,
        packet_time_s=used_s.reshape(packet.shape),
        trusted=(late <= 0.5 * LONGEST_GAP_S).reshape(packet.shape),
    )


def _overlap(times_s: list[np.ndarray]) -> bool:
    return max(row[0] for row in times_s) <= min(row[-1] for row in times_s)


def _own_rate_hz(time_s: np.ndarray) -> float:
    """Packets per second by the median step that is not zero; 0 of one packet.

    At most twice the mean rate: bursts with long pauses have no rate of their own.
    """
    steps = np.diff(time_s)
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0
    return float(min(1.0 / np.median(steps), 2.0 * len(steps) / steps.sum()))
