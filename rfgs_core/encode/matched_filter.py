# SPDX-License-Identifier: Apache-2.0
"""Matched filter: coherent within a device pair, combined by the caller between pairs.

For a point p and a pair (a, b) of devices the filter output is

    y(p) = (1/N) Σ_{t∈a, r∈b, f} H[t, r, f] exp(+j 2π f (|p − x_t| + |p − x_r|) / c),

the classical back-projection. It is evaluated through an oversampled delay profile of each
link, which is exact to the interpolation error of a linear reading between profile samples.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Delay-profile samples per resolution cell 1/B; 16 keeps the linear reading within 0.5 %.
OVERSAMPLING = 16


#: Points handled by one thread before it fetches more; sets the size of its scratch arrays.
CHUNK = 256


@numba.njit(fastmath=True, cache=True, inline="always")
def _legs(point, elements, centre_k, distance, turn):
    """Distance from a point to each element and the phasor exp(+j k d) per sub-band."""
    for e in range(elements.shape[0]):
        dx, dy, dz = (
            point[0] - elements[e, 0],
            point[1] - elements[e, 1],
            point[2] - elements[e, 2],
        )
        d = np.sqrt(dx * dx + dy * dy + dz * dz)
        distance[e] = d
        for band in range(centre_k.shape[0]):
            # Reduce in double: at 60 GHz the phase is thousands of radians.
            cycles = centre_k[band] * d / (2.0 * np.pi)
            phase = np.float32(2.0 * np.pi * (cycles - np.floor(cycles)))
            turn[band, e] = np.complex64(np.cos(phase) + 1j * np.sin(phase))


@numba.njit(parallel=True, fastmath=True, cache=True)
def _back_project(profiles, centre_k, samples_per_m, tx_xyz, rx_xyz, links, points, out):
    """Adds each link's profile, read at the point's path length, to its pair's sum.

    `links` holds transmitting element, receiving element and pair of each profile.
    """
    num_links, num_bands, num_samples = profiles.shape
    for chunk in numba.prange((points.shape[0] + CHUNK - 1) // CHUNK):
        d_t, turn_t = np.zeros(len(tx_xyz)), np.zeros((num_bands, len(tx_xyz)), np.complex64)
        d_r, turn_r = np.zeros(len(rx_xyz)), np.zeros((num_bands, len(rx_xyz)), np.complex64)
        for n in range(chunk * CHUNK, min((chunk + 1) * CHUNK, points.shape[0])):
            _legs(points[n], tx_xyz, centre_k, d_t, turn_t)
            _legs(points[n], rx_xyz, centre_k, d_r, turn_r)
            for link in range(num_links):
                t, r, pair = links[link, 0], links[link, 1], links[link, 2]
                at = (d_t[t] + d_r[r]) * samples_per_m
                low = int(at)
                frac = np.float32(at - low)
                low = low % num_samples
                high = low + 1 if low + 1 < num_samples else 0
                for band in range(num_bands):
                    value = profiles[link, band, low] * (np.float32(1) - frac)
                    value += profiles[link, band, high] * frac
                    out[n, pair, band] += value * turn_t[band, t] * turn_r[band, r]


def _band_profiles(
    csi: Complex[np.ndarray, "link subcarrier"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    num_bands: int,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Oversampled delay profiles per sub-band.

    Returns:
        Profiles (link, band, sample), wave number of each band's centre [rad/m], and profile
        samples per metre of path.
    """
    spacing = float(freq_hz[1] - freq_hz[0])
    size = OVERSAMPLING * len(freq_hz)
    profiles = np.zeros((csi.shape[0], num_bands, size), dtype=np.complex64)
    centre_k = np.zeros(num_bands)
    for band, tones in enumerate(np.array_split(np.arange(len(freq_hz)), num_bands)):
        offset = int(tones[len(tones) // 2])
        spectrum = np.zeros((csi.shape[0], size), dtype=np.complex64)
        spectrum[:, (tones - offset) % size] = csi[:, tones]
        # ifft carries exp(+j2π n m / size): the profile at delay m / (size · Δf).
        profiles[:, band] = np.fft.ifft(spectrum, axis=1) * size / len(tones)
        centre_k[band] = 2.0 * np.pi * float(freq_hz[offset]) / SPEED_OF_LIGHT
    return profiles, centre_k, spacing * size / SPEED_OF_LIGHT


def matched_filter(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
    num_bands: int = 1,
) -> Complex[np.ndarray, "pair band N"]:
    """Complex matched-filter output per device pair and sub-band.

    Args:
        csi: Channel; uniform tone grid.
        tx_xyz: Transmitting elements [m].
        rx_xyz: Receiving elements [m].
        pair: Which sum a link belongs to, 0..P-1; negative links are left out.
        freq_hz: Tone frequencies [Hz], equally spaced.
        points: Where to evaluate [m].
        num_bands: Sub-bands of equal width, each filtered on its own.

    Returns:
        Mean over the links and tones of a pair, shape (pair, band, N).
    """
    tx_index, rx_index = np.nonzero(pair >= 0)
    link_pair = pair[tx_index, rx_index].astype(np.int64)
    profiles, centre_k, samples_per_m = _band_profiles(csi[tx_index, rx_index], freq_hz, num_bands)
    num_pairs = int(link_pair.max()) + 1
    out = np.zeros((len(points), num_pairs, num_bands), dtype=np.complex64)
    _back_project(
        profiles,
        centre_k,
        samples_per_m,
        np.ascontiguousarray(tx_xyz, dtype=np.float64),
        np.ascontiguousarray(rx_xyz, dtype=np.float64),
        np.stack([tx_index, rx_index, link_pair], axis=1),
        np.ascontiguousarray(points, dtype=np.float64),
        out,
    )
    counts = np.bincount(link_pair, minlength=num_pairs)
    return out.transpose(1, 2, 0) / np.maximum(counts, 1)[:, None, None].astype(np.float32)


def device_pairs(
    tx_device: Int[np.ndarray, "tx"],
    rx_device: Int[np.ndarray, "rx"],
    use: Bool[np.ndarray, "tx rx"],
) -> tuple[Int[np.ndarray, "tx rx"], list[tuple[int, int]]]:
    """Numbers the ordered (transmitting, receiving) device pairs that have a used link.

    Returns:
        Pair index per link, -1 where unused, and the list of pairs.
    """
    pair = np.full(use.shape, -1, dtype=np.int64)
    names = sorted(
        {
            (int(a), int(b))
            for a, b in zip(
                np.broadcast_to(tx_device[:, None], use.shape)[use],
                np.broadcast_to(rx_device[None, :], use.shape)[use],
                strict=True,
            )
        }
    )
    for index, (a, b) in enumerate(names):
        pair[(tx_device[:, None] == a) & (rx_device[None, :] == b) & use] = index
    return pair, names


def matched_filter_map(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
) -> Float[np.ndarray, "pair N"]:
    """Matched-filter power per device pair over the whole band, see `matched_filter`."""
    return np.abs(matched_filter(csi, tx_xyz, rx_xyz, pair, freq_hz, points)[:, 0]) ** 2


def matched_filter_features(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
    num_features: int = 32,
) -> Float[np.ndarray, "N feature"]:
    """φ(p) of paper eq. 2: matched-filter amplitude per sub-band, incoherent between pairs.

    The entries are ordered by frequency, which gives the paper's gradient across frequency
    bins (section 3.5) a meaning. Scaled so that the RMS of ‖φ‖ over `points` is one.
    """
    power = np.abs(matched_filter(csi, tx_xyz, rx_xyz, pair, freq_hz, points, num_features)) ** 2
    features = np.sqrt(power.mean(axis=0)).T
    rms = np.sqrt(np.mean(np.sum(features**2, axis=1)))
    return (features / max(float(rms), 1e-30)).astype(np.float32)
