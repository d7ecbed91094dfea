# SPDX-License-Identifier: Apache-2.0
"""One take of Widar 3.0: six receivers on one clock, and its body velocity profile."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.capture import intel5300
from rfgs_core.capture.layout_file import CaptureLayout
from rfgs_core.capture.table_file import read_tables
from rfgs_core.capture.widar.tables import (
    CENTRE_HZ,
    RATE_HZ,
    RECEIVERS,
    RECEIVERS_M,
    TRANSMITTER_M,
)
from rfgs_core.errors import RfgsFormatError
from rfgs_core.radio import DevicePose
from rfgs_core.sanitize.clock import common_clock, resample

#: Most of a profile's axes; the release has 20 × 20 and a few tens of times.
_LARGEST_PROFILE = 20 * 20 * 10_000
#: Longest gap between packets that a tick may lie in [s]; gaps up to 9 ms are common.
LONGEST_GAP_S = 0.02
#: Height of the antennas, which the release does not tell [m].
HEIGHT_M = 1.0


@dataclass(frozen=True)
class Recording:
    """Channels of all receivers at common ticks."""

    values: Complex64[np.ndarray, "time receiver rx subcarrier"]
    """The packet nearest to each tick, as the card reported it."""
    trusted: Bool[np.ndarray, "time receiver"]
    """Whether packets were near the tick."""
    time_s: Float64[np.ndarray, "time"]
    """Ticks from the start [s]."""
    receivers: tuple[int, ...]
    """Numbers of the receivers, in the order of the axis."""
    warnings: list[str]
    """What was wrong with the files."""


def read_take(files: dict[int, Path], rate_hz: float = RATE_HZ) -> Recording:
    """Reads a take's files onto one clock.

    Receivers stamp packets by clocks of their own that begin with their first packet, so these
    are taken for the same moment; packets are nominally 1 ms apart, with gaps up to 9 ms.

    Args:
        files: File of each receiver.
        rate_hz: Ticks per second.

    Raises:
        RfgsFormatError: A file holds no channel, or other antennas than three and one.
    """
    captures, warnings = [], []
    for number, path in sorted(files.items()):
        reading = intel5300.read(path)
        capture = reading.largest
        if capture.values.shape[2] != len(RECEIVERS) // 2 or capture.values.shape[3] != 1:
            raise RfgsFormatError(
                f"{path}: expected 3 RX and 1 TX antenna, found {capture.values.shape[2]} and "
                f"{capture.values.shape[3]}"
            )
        captures.append(capture)
        warnings += [f"r{number}: {warning}" for warning in reading.warnings]
    ticks_s = common_clock([capture.time_s for capture in captures], rate_hz)
    rows = [
        resample(capture.values[:, 0, :, 0], capture.time_s, ticks_s, "nearest", LONGEST_GAP_S)
        for capture in captures
    ]
    return Recording(
        values=np.stack([values for values, _ in rows], axis=1),
        trusted=np.stack([trusted for _, trusted in rows], axis=1),
        time_s=ticks_s,
        receivers=tuple(sorted(files)),
        warnings=warnings,
    )


def layout_of(receivers: tuple[int, ...] = RECEIVERS, fps: float = 10.0) -> CaptureLayout:
    """Where Widar's radios stood, for `rfgs import`: a transmitter and receivers of 3 antennas.

    Heights and the direction of the arrays are not told; they are guessed, and said to be.
    """
    still = (1.0, 0.0, 0.0, 0.0)
    devices = [DevicePose("tx", (*TRANSMITTER_M, HEIGHT_M), still, "TRANSMITTER")]
    devices += [
        DevicePose(f"r{number}", (*RECEIVERS_M[number], HEIGHT_M), still, "RECEIVER")
        for number in receivers
    ]
    reason = "the release does not tell it"
    rows = (("height", f"{HEIGHT_M} m"), ("direction of the arrays", "along y"))
    return CaptureLayout(
        devices=tuple(devices),
        files=(None,) * len(devices),
        offsets_s=(0.0,) * len(devices),
        name="widar",
        radio="widar",
        centre_hz=CENTRE_HZ,
        fps=fps,
        rate_hz=RATE_HZ,
        guesses=tuple(
            {"object": "widar", "what": what, "value": value, "reason": reason}
            for what, value in rows
        ),
    )


def read_bvp(path: Path) -> Float64[np.ndarray, "vx vy time"]:
    """Reads a body velocity profile: power over velocities of ±2 m/s, ten times a second.

    Returns:
        `velocity_spectrum_ro` of the file, 20 × 20 velocities; times may be none.

    Raises:
        RfgsFormatError: The file is damaged or holds no profile.
    """
    profile = read_tables(path, "mat").get("velocity_spectrum_ro")
    if profile is not None and profile.ndim == 2:
        profile = profile[..., None]  # MATLAB drops an axis of one time.
    if profile is None or profile.shape[:2] != (20, 20) or profile.size > _LARGEST_PROFILE:
        raise RfgsFormatError(f"{path}: expected velocity_spectrum_ro, 20 × 20 × times")
    if profile.dtype.kind not in "fiu" or not np.isfinite(profile).all():
        raise RfgsFormatError(f"{path}: velocity_spectrum_ro: expected finite numbers")
    return profile.astype(np.float64)
