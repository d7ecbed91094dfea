# SPDX-License-Identifier: Apache-2.0
"""Back-projection: delay profiles of links, read at the path lengths of points and added.

A profile is oversampled, so that reading it linearly between samples is exact to half a per cent;
the phase of its centre frequency is put back with the true path length.
"""

from __future__ import annotations

import numba
import numpy as np
from jaxtyping import Complex, Float, Int

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_transform

#: Delay-profile samples per resolution cell 1/B; 16 keeps the linear reading within 0.5 %.
OVERSAMPLING = 16


#: Points that share one pass over all links, so that a link's profile stays in cache.
CHUNK = 64
#: Points that an encoder reads at once; whole chunks, so that it makes no difference.
POINTS = 256 * CHUNK


@numba.njit(fastmath=True, cache=True)
def _legs(points, elements, k, distance, turn):
    """Distances of each element to a chunk of points and the phasors exp(+j k d).

    Phases are reduced in double: at 60 GHz they reach thousands of radians.
    """
    for e in range(elements.shape[0]):
        for n in range(points.shape[0]):
            dx = points[n, 0] - elements[e, 0]
            dy = points[n, 1] - elements[e, 1]
            dz = points[n, 2] - elements[e, 2]
            d = np.sqrt(dx * dx + dy * dy + dz * dz)
            distance[e, n] = d
            cycles = k * d / (2.0 * np.pi)
            phase = np.float32(2.0 * np.pi * (cycles - np.floor(cycles)))
            turn[0, e, n] = np.cos(phase)
            turn[1, e, n] = np.sin(phase)


@numba.njit(fastmath=True, cache=True)
def _read_profile(profile, samples_per_m, d_t, d_r, turn_t, turn_r, total):
    """Adds one link's profile at the path lengths of a chunk, turned back by its phase."""
    size = profile.shape[1] - 1
    for n in range(d_t.shape[0]):
        at = (d_t[n] + d_r[n]) * samples_per_m
        at -= size * np.floor(at / size)
        low = np.int32(at)
        frac = np.float32(at - low)
        re = profile[0, low] + frac * (profile[0, low + 1] - profile[0, low])
        im = profile[1, low] + frac * (profile[1, low + 1] - profile[1, low])
        cos = turn_t[0, n] * turn_r[0, n] - turn_t[1, n] * turn_r[1, n]
        sin = turn_t[0, n] * turn_r[1, n] + turn_t[1, n] * turn_r[0, n]
        total[0, n] += re * cos - im * sin
        total[1, n] += re * sin + im * cos


@numba.njit(parallel=True, cache=True)
def _add_profiles(profiles, centre_k, samples_per_m, tx_xyz, rx_xyz, links, points, out):
    """Fills `out[pair, band, re/im, point]`; `links` rows are tx, rx and pair of a profile."""
    for chunk in numba.prange((points.shape[0] + CHUNK - 1) // CHUNK):
        here = slice(chunk * CHUNK, min((chunk + 1) * CHUNK, points.shape[0]))
        count = here.stop - here.start
        d_t = np.zeros((len(tx_xyz), count))
        d_r = np.zeros((len(rx_xyz), count))
        turn_t = np.zeros((2, len(tx_xyz), count), np.float32)
        turn_r = np.zeros((2, len(rx_xyz), count), np.float32)
        for band in range(len(centre_k)):
            _legs(points[here], tx_xyz, centre_k[band], d_t, turn_t)
            _legs(points[here], rx_xyz, centre_k[band], d_r, turn_r)
            for link in range(len(links)):
                t, r, pair = links[link]
                _read_profile(
                    profiles[link, band],
                    samples_per_m,
                    d_t[t],
                    d_r[r],
                    turn_t[:, t],
                    turn_r[:, r],
                    out[pair, band, :, here],
                )


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
        np.ascontiguousarray(tx_xyz, dtype=np.float64),
        np.ascontiguousarray(rx_xyz, dtype=np.float64),
        np.stack([tx_index, rx_index, link_pair], axis=1),
        np.ascontiguousarray(points, dtype=np.float64),
        out,
    )
    counts = np.bincount(link_pair, minlength=num_pairs)
    total = out[:, :, 0] + 1j * out[:, :, 1]
    return total / np.maximum(counts, 1)[:, None, None].astype(np.float32)
