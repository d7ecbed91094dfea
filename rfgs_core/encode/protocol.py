# SPDX-License-Identifier: Apache-2.0
"""What every encoder is: a function from one frame's channel and a point to R^32 (eq. 2)."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Bool, Complex64, Float, Float32, Float64, Int64

from rfgs_core.radio import Layout

#: Dimension of φ (paper section 3.2).
FEATURES = 32


class FrameChannel(Protocol):
    """One frame's channel and where it was measured; `measure.Observations` is one."""

    @property
    def delta(self) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Channel change, zero where hidden."""
        ...

    @property
    def packets(self) -> Complex64[np.ndarray, "packet tx rx subcarrier"] | None:
        """Change at each packet, zero where hidden; None where one was read."""
        ...

    @property
    def packet_interval_s(self) -> float:
        """Time between packets [s]; zero where only one was read."""
        ...

    @property
    def monostatic(self) -> bool:
        """Whether every visible link stays within one device (a radar)."""
        ...

    @property
    def links(self) -> Bool[np.ndarray, "tx rx"]:
        """Links that may be read."""
        ...

    @property
    def subcarriers(self) -> Bool[np.ndarray, "subcarrier"]:
        """Subcarriers that may be read."""
        ...

    @property
    def layout(self) -> Layout:
        """Antenna elements."""
        ...

    @property
    def freq_hz(self) -> Float64[np.ndarray, "subcarrier"]:
        """Subcarrier frequencies [Hz], equally spaced."""
        ...

    @property
    def pairs(self) -> tuple[Int64[np.ndarray, "tx rx"], list[tuple[int, int]]]:
        """Device pair of each readable link (−1 elsewhere) and the list of pairs."""
        ...


class Encoder(Protocol):
    """φ(p): what the channel of a frame says about points.

    The 32 entries are ordered by frequency, which gives the paper's gradient across frequency
    bins (section 3.5) a meaning. Only ratios count: `unit_rms` scales the features of all
    points of a frame together. The value at a point does not depend on the other points, and
    no gradient leaves an encoder.
    """

    def __call__(
        self, seen: FrameChannel, points: Float64[np.ndarray, "N 3"]
    ) -> Float32[np.ndarray, "N 32"]:
        """Features at `points` [m], at least zero.

        Raises:
            RfgsError: The encoder was made for another radio.
        """
        ...


def unit_rms(features: Float[np.ndarray, "N feature"]) -> Float32[np.ndarray, "N feature"]:
    """Features scaled so that the RMS of ‖φ‖ over the points is one; silence stays zero."""
    rms = np.sqrt(np.mean(np.sum(features**2, axis=1)))
    return (features / max(float(rms), 1e-30)).astype(np.float32)
