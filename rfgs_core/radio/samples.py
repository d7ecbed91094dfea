# SPDX-License-Identifier: Apache-2.0
"""When, and from where, a radio measures within every frame: packets, chirps or pulses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from rfgs_core.errors import RfgsError
from rfgs_core.radio.layout import DevicePose, layout
from rfgs_core.radio.presets import Radio


@dataclass(frozen=True)
class FrameSamples:
    """The samples of a frame, the same in every frame.

    The first one is taken at the frame's own time, so whoever wants one channel per frame
    takes that.
    """

    offset_s: Float64[np.ndarray, "sample"] = field(default_factory=lambda: np.zeros(1))
    """Time of each sample after its frame [s], ascending from 0; all 0 if the scene waits."""
    tx_xyz: Float64[np.ndarray, "sample tx 3"] | None = None
    """Transmitting elements at each sample [m]; None where they stand still."""
    rx_xyz: Float64[np.ndarray, "sample rx 3"] | None = None
    """Receiving elements at each sample [m]; None where they stand still."""

    def __len__(self) -> int:
        return len(self.offset_s)

    @property
    def antennas_move(self) -> bool:
        """Whether antennas change place from sample to sample, as in a synthetic aperture."""
        return self.tx_xyz is not None or self.rx_xyz is not None


def frame_samples(
    radio: Radio, fps: float, devices: list[DevicePose] | None = None
) -> FrameSamples:
    """The samples a radio takes of each frame.

    Sample k is `k · sample_interval_s` after its frame, or `k/(N · fps)` where the radio gives
    no interval. Where the antennas move, the scene stands still meanwhile: all samples are taken
    at the frame's own time.

    Args:
        radio: The radio.
        fps: Frames per second.
        devices: Places of a device that moves, one for each sample; None leaves the antennas'
            places out.

    Raises:
        RfgsError: There is no sample, they would run into the next frame, or there are not as
            many places as samples.
    """
    if radio.antennas_move:
        return _aperture(radio, devices)
    count, frame_s = radio.samples_per_frame, 1.0 / fps
    interval_s = radio.sample_interval_s or frame_s / max(count, 1)
    # A single sample has no interval to fit in.
    too_long = count > 1 and count * interval_s > frame_s * (1.0 + 1e-9)
    if count < 1 or interval_s < 0.0 or too_long:
        raise RfgsError(
            f"radio {radio.name!r}: {count} samples per frame, {interval_s * 1e3:g} ms apart, do "
            f"not fit a frame of {frame_s * 1e3:g} ms; ask for at least 1 and at most "
            f"{int(frame_s / interval_s * (1.0 + 1e-9)) if interval_s > 0.0 else 1}"
        )
    return FrameSamples(np.arange(count) * interval_s)


def _aperture(radio: Radio, devices: list[DevicePose] | None) -> FrameSamples:
    """One sample at each place of a device that moves."""
    count = radio.samples_per_frame
    if devices is None:
        return FrameSamples(np.zeros(count))
    if len(devices) != count:
        raise RfgsError(
            f"radio {radio.name!r}: {len(devices)} places for {count} samples per frame; give as "
            "many devices as samples, in the order of their names"
        )
    places = [layout(radio, devices, sample) for sample in range(count)]
    return FrameSamples(
        np.zeros(count),
        np.stack([place.tx_xyz for place in places]),
        np.stack([place.rx_xyz for place in places]),
    )


def pose_span_s(radio: Radio) -> float | None:
    """Time after each frame over which a radio needs to know how things move [s].

    Returns:
        0 for all of it until the next frame; None if the frame itself is enough.
    """
    if radio.samples_per_frame == 1 or radio.antennas_move:
        return None
    return (radio.samples_per_frame - 1) * radio.sample_interval_s
