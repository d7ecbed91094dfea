# SPDX-License-Identifier: Apache-2.0
"""Back-projection: delay profiles of links, read at the path lengths of points and added.

A profile is oversampled, so that reading it linearly between samples is exact to half a per cent;
the phase of its centre frequency is put back with the true path length.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_transform
from rfgs_core.vector_math import FAST_MATH, sine_cosine_of_turns

#: Delay-profile samples per resolution cell 1/B; 16 keeps the linear reading within 0.5 %.
OVERSAMPLING = 16


#: Points that share one pass over all links, so that a link's profile stays in cache.
CHUNK = 64
#: Points that an encoder reads at once; whole chunks, so that it makes no difference.
POINTS = 256 * CHUNK

_ONE = np.uint64(1)


@numba.njit(forceinline=True, fastmath=FAST_MATH, cache=True)
def _legs(
    points: np.ndarray,
    elements: np.ndarray,
    per_m: tuple[float, float],
    samples: np.ndarray,
    turn: np.ndarray,
) -> None:
    """Distances of each element to a chunk of points in samples, and the phasors exp(+j k d).

    Phases are reduced in double: at 60 GHz they reach thousands of radians.
    """
    # One loop with all of this would not become vector code: too many arrays that might overlap.
    x, y, z = points[0], points[1], points[2]
    turns_per_sample = per_m[1] / per_m[0]
    for e in range(len(elements)):
        at, cosines, sines = samples[e], turn[e, 0], turn[e, 1]
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        for n in range(len(x)):
            p, q, r = x[n] - a, y[n] - b, z[n] - c
            at[n] = math.sqrt(p * p + q * q + r * r) * per_m[0]
        for n in range(len(x)):
            turns = at[n] * turns_per_sample
            sine, cosine = sine_cosine_of_turns(np.float32(turns - np.floor(turns + 0.5)))
            cosines[n], sines[n] = cosine, sine


@numba.njit(forceinline=True, fastmath=FAST_MATH, cache=True)
def _places(a: np.ndarray, b: np.ndarray, size: int, low: np.ndarray, share: np.ndarray) -> None:
    """Sample below each path length, and how far above it the length is."""
    times, per = float(size), 1.0 / size
    for n in range(len(low)):
        at = a[n] + b[n]
        at -= times * np.floor(at * per)
        low[n] = np.int32(at)
        share[n] = np.float32(at - low[n])


@numba.njit(forceinline=True, fastmath=FAST_MATH, cache=True)
def _read(profile: np.ndarray, low: np.ndarray, share: np.ndarray, out: np.ndarray) -> None:
    """Real or imaginary part of a profile, linear between samples."""
    for n in range(len(low)):
        # Signed indices might count from the end, for all the compiler knows: no vector code.
        i = np.uint64(low[n])
        below = profile[i]
        out[n] = below + share[n] * (profile[i + _ONE] - below)


@numba.njit(forceinline=True, fastmath=FAST_MATH, cache=True)
def _add_turned(
    real: np.ndarray, imaginary: np.ndarray, t: np.ndarray, r: np.ndarray, total: np.ndarray
) -> None:
    """Adds what was read, turned back by the phases of both legs."""
    a, b, c, d, sums, others = t[0], t[1], r[0], r[1], total[0], total[1]
    for n in range(len(real)):
        cosine, sine = a[n] * c[n] - b[n] * d[n], a[n] * d[n] + b[n] * c[n]
        sums[n] += real[n] * cosine - imaginary[n] * sine
        others[n] += real[n] * sine + imaginary[n] * cosine


@numba.njit(parallel=True, cache=True)
def _add_profiles(
    profiles: np.ndarray,
    centre_k: np.ndarray,
    samples_per_m: float,
    ends: tuple[np.ndarray, np.ndarray],
    links: np.ndarray,
    points: np.ndarray,
    out: np.ndarray,
) -> None:
    """Fills `out[pair, band, re/im, point]`; `links` rows are tx, rx and pair of a profile."""
    tx_xyz, rx_xyz = ends
    for chunk in numba.prange((points.shape[1] + CHUNK - 1) // CHUNK):
        first = chunk * CHUNK
        count = min(CHUNK, points.shape[1] - first)
        here = points[:, first : first + count].copy()
        d_t, d_r = np.zeros((len(tx_xyz), count)), np.zeros((len(rx_xyz), count))
        t = np.zeros((len(tx_xyz), 2, count), np.float32)
        r = np.zeros((len(rx_xyz), 2, count), np.float32)
        low, share = np.zeros(count, np.int32), np.zeros(count, np.float32)
        read, total = np.zeros((2, count), np.float32), np.zeros((len(out), 2, count), np.float32)
        for band in range(len(centre_k)):
            per_m = (samples_per_m, centre_k[band] / (2.0 * np.pi))
            _legs(here, tx_xyz, per_m, d_t, t)
            _legs(here, rx_xyz, per_m, d_r, r)
            total[:] = 0.0
            for link in range(len(links)):
                tx, rx, pair = links[link]
                _places(d_t[tx], d_r[rx], profiles.shape[3] - 1, low, share)
                _read(profiles[link, band, 0], low, share, read[0])
                _read(profiles[link, band, 1], low, share, read[1])
                _add_turned(read[0], read[1], t[tx], r[rx], total[pair])
            out[:, band, :, first : first + count] = total


def oversampled_profiles(
    csi: Complex[np.ndarray, "link *channel subcarrier"],
    freq_hz: Float[np.ndarray, "subcarrier"],
) -> tuple[np.ndarray, float, float]:
    """Delay profiles, `OVERSAMPLING` samples per resolution cell 1/B.

    Args:
        csi: Channel at the subcarriers.
        freq_hz: The subcarriers [Hz], equally spaced.

    Returns:
        Profiles (…, sample), divided by the number of subcarriers and relative to the middle one,
        whose wave number [rad/m] follows, and profile samples per metre of path.
    """
    size, offset = OVERSAMPLING * len(freq_hz), len(freq_hz) // 2
    narrow = csi.astype(np.complex64, copy=False)
    places = np.arange(len(freq_hz)) - offset
    profiles = delay_transform(narrow, size, places) * size / len(freq_hz)
    centre_k = 2.0 * np.pi * float(freq_hz[offset]) / SPEED_OF_LIGHT
    spacing_hz = float(freq_hz[1] - freq_hz[0])
    return profiles, centre_k, spacing_hz * size / SPEED_OF_LIGHT


def back_project(
    profiles: Complex[np.ndarray, "link channel sample"],
    centre_k: Float[np.ndarray, "channel"],
    samples_per_m: float,
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    points: Float[np.ndarray, "N 3"],
) -> Complex[np.ndarray, "pair channel N"]:
    """Reads delay profiles at the path lengths of points and adds the links of each pair.

    Args:
        profiles: One per link with `pair >= 0` (in row-major order) and channel, as
            `oversampled_profiles` gives them.
        centre_k: Wave number that each channel's profiles refer to [rad/m].
        samples_per_m: Profile samples per metre of path.
        tx_xyz: Transmitting elements [m].
        rx_xyz: Receiving elements [m].
        pair: Which sum a link belongs to; negative links are left out.
        points: Where to evaluate [m].

    Returns:
        Mean over the links of a pair.
    """
    tx_index, rx_index = np.nonzero(pair >= 0)
    link_pair = pair[tx_index, rx_index].astype(np.int64)
    num_pairs = int(link_pair.max()) + 1
    out = np.zeros((num_pairs, len(centre_k), 2, len(points)), dtype=np.float32)
    # The first sample again at the end: reading between the last two needs no wrap.
    size = profiles.shape[2]
    split = np.zeros((*profiles.shape[:2], 2, size + 1), profiles.real.dtype)
    split[:, :, 0, :size], split[:, :, 1, :size] = profiles.real, profiles.imag
    split[..., size] = split[..., 0]
    _add_profiles(
        split,
        centre_k,
        samples_per_m,
        (np.ascontiguousarray(tx_xyz, dtype=np.float64), np.ascontiguousarray(rx_xyz, np.float64)),
        np.stack([tx_index, rx_index, link_pair], axis=1),
        np.ascontiguousarray(points.T, dtype=np.float64),
        out,
    )
    counts = np.bincount(link_pair, minlength=num_pairs)
    total = out[:, :, 0] + 1j * out[:, :, 1]
    return total / np.maximum(counts, 1)[:, None, None].astype(np.float32)
