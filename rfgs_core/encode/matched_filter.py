# SPDX-License-Identifier: Apache-2.0
"""Matched filter: coherent within a device pair, combined by the caller between pairs.

For a point p and a pair (a, b) of devices the filter output is

    y(p) = (1/N) Σ_{t∈a, r∈b, f} H[t, r, f] exp(+j 2π f (|p − x_t| + |p − x_r|) / c),

the classical back-projection. Over the whole band it is evaluated through an oversampled delay
profile of each link, which is exact to the interpolation error of a linear reading between profile
samples; over narrow sub-bands by their sums.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Float32, Float64, Int

from rfgs_core.encode.back_projection import POINTS, back_project, oversampled_profiles
from rfgs_core.encode.band_sums import sum_bands
from rfgs_core.encode.preprocess import hamming, normalise_subcarriers
from rfgs_core.encode.protocol import FEATURES, FrameChannel
from rfgs_core.radio import Layout


def matched_filter(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    layout: Layout,
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
    num_bands: int = 1,
) -> Complex[np.ndarray, "pair band N"]:
    """Complex matched-filter output per device pair and sub-band.

    Args:
        csi: Channel; uniform subcarrier grid.
        layout: Antenna elements.
        pair: Which sum a link belongs to, 0..P-1; negative links are left out.
        freq_hz: Subcarrier frequencies [Hz], equally spaced.
        points: Where to evaluate [m].
        num_bands: Sub-bands of equal width, each filtered on its own; at most one per subcarrier.

    Returns:
        Mean over the links and subcarriers of a pair, shape (pair, band, N).
    """
    tx_index, rx_index = np.nonzero(pair >= 0)
    return _focused(
        csi[tx_index, rx_index], layout.tx_xyz, layout.rx_xyz, pair, freq_hz, points, num_bands
    )


def _focused(
    csi: Complex[np.ndarray, "link subcarrier"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
    num_bands: int,
) -> Complex[np.ndarray, "pair band N"]:
    """The filter of the links with `pair >= 0`, in row-major order."""
    ends = {"tx_xyz": tx_xyz, "rx_xyz": rx_xyz, "pair": pair, "points": points}
    if num_bands > 1:
        parts = np.array_split(np.arange(len(freq_hz)), num_bands)
        edges = np.cumsum([0, *map(len, parts)])
        return sum_bands(csi, freq_hz, edges, **ends)
    profiles, centre_k, samples_per_m = oversampled_profiles(csi, freq_hz)
    return back_project(
        profiles[:, None], centre_k=np.array([centre_k]), samples_per_m=samples_per_m, **ends
    )


def aperture_filter(
    csi: Complex[np.ndarray, "sample subcarrier"],
    tx_xyz: Float[np.ndarray, "sample 3"],
    rx_xyz: Float[np.ndarray, "sample 3"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
) -> Complex[np.ndarray, "N"]:
    """Complex matched-filter output of a synthetic aperture: time-domain back-projection.

    Args:
        csi: Channel of one antenna pair at each of its places; uniform subcarrier grid.
        tx_xyz: Its transmitting antenna at each place [m].
        rx_xyz: Its receiving antenna at each place [m].
        freq_hz: Subcarrier frequencies [Hz], equally spaced.
        points: Where to evaluate [m].

    Returns:
        Mean over places and subcarriers, shape (N,).
    """
    own = np.where(np.eye(len(csi), dtype=bool), 0, -1)
    return _focused(csi, tx_xyz, rx_xyz, own, freq_hz, points, 1)[0, 0]


def matched_filter_map(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    layout: Layout,
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
) -> Float[np.ndarray, "pair N"]:
    """Matched-filter power per device pair over the whole band, see `matched_filter`."""
    return np.abs(matched_filter(csi, layout, pair, freq_hz, points)[:, 0]) ** 2


@dataclass(frozen=True)
class MatchedFilter:
    """The default encoder: matched-filter amplitude per sub-band, incoherent between pairs.

    The entries are ordered by frequency, which gives the paper's gradient across frequency bins
    (section 3.5) a meaning.
    """

    preprocessed: bool = False
    """Whether every subcarrier is divided by its RMS amplitude and the band is weighed by a Hamming
    window first (paper section 3.6). Phases stay complex, so that none has to be unwrapped."""

    def __call__(
        self, seen: FrameChannel, points: Float64[np.ndarray, "N 3"]
    ) -> Float32[np.ndarray, "N 32"]:
        """Root of the mean power over pairs in each of 32 sub-bands, see `Encoder`."""
        bands = min(FEATURES, len(seen.freq_hz))
        # A radio with fewer subcarriers than features has its sub-bands repeated, still in order.
        repeated = np.arange(FEATURES) * bands // FEATURES
        pair, _ = seen.pairs
        delta = _preprocessed(seen) if self.preprocessed else seen.delta
        rows = [np.zeros((0, FEATURES), np.float32)]
        # Images of all pairs and sub-bands at once would take a gigabyte for the paper's grid.
        for start in range(0, len(points), POINTS):
            here = points[start : start + POINTS]
            focused = matched_filter(delta, seen.layout, pair, seen.freq_hz, here, bands)
            power = (np.abs(focused) ** 2).mean(axis=0)
            rows.append(np.sqrt(power).T[:, repeated])
        return np.concatenate(rows)


def _preprocessed(seen: FrameChannel) -> Complex[np.ndarray, "tx rx subcarrier"]:
    """The change over the RMS of its links at each subcarrier, windowed over the whole band."""
    normalised, _ = normalise_subcarriers(seen.delta, seen.links)
    freq_hz = seen.freq_hz
    window = hamming(freq_hz, 0.5 * float(freq_hz[0] + freq_hz[-1]), float(np.ptp(freq_hz)))
    return (normalised * window).astype(np.complex64)


#: The filter as it is, and as the paper preprocesses.
MATCHED_FILTER, PAPER_FILTER = MatchedFilter(), MatchedFilter(preprocessed=True)
