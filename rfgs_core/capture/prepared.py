# SPDX-License-Identifier: Apache-2.0
"""A capture made ready for a dataset: its radio, devices, and channels frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.radio import DevicePose, Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT


@dataclass(frozen=True)
class Prepared:
    """What is written into a dataset."""

    scene: str
    """Name of the scene and the sequence."""
    radio: Radio
    """Band and antennas."""
    devices: list[DevicePose]
    """Poses; of antennas that move, the place of each pulse."""
    csi: Complex64[np.ndarray, "frame sample tx rx subcarrier"]
    """Channels."""
    static: Complex64[np.ndarray, "sample tx rx subcarrier"]
    """Channel of the empty room, or the mean over the capture; a sample each if antennas move."""
    measured: Bool[np.ndarray, "subcarrier"]
    """Subcarriers that were measured; the others were filled from their neighbours."""
    bounds_m: Float64[np.ndarray, "2 3"]
    """Minimum and maximum of the scene [m]."""
    fps: float
    """Frames per second."""
    guesses: list[dict[str, Any]] = field(default_factory=list)
    """What was not said and is guessed."""
    packet_arrays: dict[str, np.ndarray] = field(default_factory=dict)
    """Kept beside the channels: times of the packets, the scale, the subcarriers of the bins."""


def guess(thing: str, what: str, value: Any, reason: str) -> dict[str, Any]:
    """A row of what was guessed, as `sequence.json` keeps them."""
    return {"object": thing, "what": what, "value": str(value), "reason": reason}


def scale_to_free_space(
    static: Complex64[np.ndarray, "*link subcarrier"],
    centre_hz: float,
    distance_m: float,
) -> float:
    """A power of two that brings a capture near the level of free space.

    Cards report their own units. The median link is set near λ/(4πd), so that levels look like
    those of other datasets; as a power of two the factor loses no bit and is taken out exactly.

    Args:
        static: Channels of the links that exist.
        centre_hz: Centre of the band [Hz].
        distance_m: Median distance of the links [m].
    """
    level = float(np.sqrt(np.mean(np.abs(static.astype(np.complex128)) ** 2)))
    wanted = SPEED_OF_LIGHT / centre_hz / (4.0 * np.pi * max(distance_m, 0.1))
    return float(2.0 ** np.round(np.log2(wanted / level))) if level > 0 else 1.0


def bounds_around(places_m: Sequence[tuple[float, float, float]]) -> Float64[np.ndarray, "2 3"]:
    """Bounds 1 m around devices, and at least as high as a room [m]."""
    places = np.array(places_m, np.float64)
    low, high = places.min(axis=0) - 1.0, places.max(axis=0) + 1.0
    high[2] = max(high[2], low[2] + 2.5)
    return np.stack([low, high])
