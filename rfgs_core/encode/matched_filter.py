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
from jaxtyping import Bool, Complex, Float, Float32, Float64, Int

from rfgs_core.encode.protocol import FEATURES, FrameChannel, unit_rms
from rfgs_core.radio.constants import SPEED_OF_LIGHT

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
def _back_project(profiles, centre_k, samples_per_m, tx_xyz, rx_xyz, links, points, out):
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
    csi: Complex[np.ndarray, "link *channel tone"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    tones: Int[np.ndarray, "tone"] | None = None,
) -> tuple[np.ndarray, float, float]:
    """Delay profiles of some tones, `OVERSAMPLING` samples per resolution cell of the whole band.

    Args:
        csi: Channel at the tones.
        freq_hz: All tones of the radio [Hz], equally spaced.
        tones: Which of them `csi` holds; None for all.

    Returns:
        Profiles (…, sample), divided by the number of tones and relative to the middle one,
        whose wave number [rad/m] follows, and profile samples per metre of path.
    """
    tones = np.arange(len(freq_hz)) if tones is None else tones
    size = OVERSAMPLING * len(freq_hz)
    offset = int(tones[len(tones) // 2])
    spectrum = np.zeros((*csi.shape[:-1], size), dtype=np.complex64)
    spectrum[..., (tones - offset) % size] = csi
    # ifft carries exp(+j2π n m / size): the profile at delay m / (size · Δf).
    profiles = np.fft.ifft(spectrum, axis=-1) * size / len(tones)
    centre_k = 2.0 * np.pi * float(freq_hz[offset]) / SPEED_OF_LIGHT
    spacing_hz = float(freq_hz[1] - freq_hz[0])
    return profiles, centre_k, spacing_hz * size / SPEED_OF_LIGHT


def _band_profiles(
    csi: Complex[np.ndarray, "link subcarrier"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    num_bands: int,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Profiles (link, band, sample) of each sub-band, as `images` takes them."""
    samples_per_m = 0.0
    profiles = np.zeros((len(csi), num_bands, OVERSAMPLING * len(freq_hz)), dtype=np.complex64)
    centre_k = np.zeros(num_bands)
    for band, tones in enumerate(np.array_split(np.arange(len(freq_hz)), num_bands)):
        profiles[:, band], centre_k[band], samples_per_m = oversampled_profiles(
            csi[:, tones], freq_hz, tones
        )
    return profiles, centre_k, samples_per_m


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
        num_bands: Sub-bands of equal width, each filtered on its own; at most one per tone.

    Returns:
        Mean over the links and tones of a pair, shape (pair, band, N).
    """
    tx_index, rx_index = np.nonzero(pair >= 0)
    profiles = _band_profiles(csi[tx_index, rx_index], freq_hz, num_bands)
    return images(*profiles, tx_xyz, rx_xyz, pair, points)


def aperture_filter(
    csi: Complex[np.ndarray, "sample subcarrier"],
    tx_xyz: Float[np.ndarray, "sample 3"],
    rx_xyz: Float[np.ndarray, "sample 3"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
) -> Complex[np.ndarray, "N"]:
    """Complex matched-filter output of a synthetic aperture: time-domain back-projection.

    Args:
        csi: Channel of one antenna pair at each of its places; uniform tone grid.
        tx_xyz: Its transmitting antenna at each place [m].
        rx_xyz: Its receiving antenna at each place [m].
        freq_hz: Tone frequencies [Hz], equally spaced.
        points: Where to evaluate [m].

    Returns:
        Mean over places and tones, shape (N,).
    """
    own = np.where(np.eye(len(csi), dtype=bool), 0, -1)
    return images(*_band_profiles(csi, freq_hz, 1), tx_xyz, rx_xyz, own, points)[0, 0]


def images(
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
    profiles = np.concatenate([profiles, profiles[..., :1]], axis=2)
    split = np.stack([profiles.real, profiles.imag], axis=2)
    _back_project(
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
    return unit_rms(_sub_band_amplitudes(csi, tx_xyz, rx_xyz, pair, freq_hz, points, num_features))


def _sub_band_amplitudes(
    csi: Complex[np.ndarray, "tx rx subcarrier"],
    tx_xyz: Float[np.ndarray, "tx 3"],
    rx_xyz: Float[np.ndarray, "rx 3"],
    pair: Int[np.ndarray, "tx rx"],
    freq_hz: Float[np.ndarray, "subcarrier"],
    points: Float[np.ndarray, "N 3"],
    num_features: int,
) -> Float[np.ndarray, "N feature"]:
    """Root of the mean power over pairs in each sub-band."""
    bands = min(num_features, len(freq_hz))
    power = np.abs(matched_filter(csi, tx_xyz, rx_xyz, pair, freq_hz, points, bands)) ** 2
    # A radio with fewer tones than features has its sub-bands repeated, still in order.
    return np.sqrt(power.mean(axis=0)).T[:, np.arange(num_features) * bands // num_features]


class MatchedFilter:
    """The default encoder: `matched_filter_features` before they are scaled."""

    def __call__(
        self, seen: FrameChannel, points: Float64[np.ndarray, "N 3"]
    ) -> Float32[np.ndarray, "N 32"]:
        """Amplitude of each of 32 sub-bands, see `Encoder`."""
        elements, (pair, _) = seen.layout, seen.pairs
        rows = [np.zeros((0, FEATURES), np.float32)]
        # Images of all pairs and sub-bands at once would take a gigabyte for the paper's grid.
        for start in range(0, len(points), POINTS):
            geometry = (elements.tx_xyz, elements.rx_xyz, pair, seen.freq_hz)
            here = points[start : start + POINTS]
            rows.append(_sub_band_amplitudes(seen.delta, *geometry, here, FEATURES))
        return np.concatenate(rows)


#: It has no settings, so one is enough.
MATCHED_FILTER = MatchedFilter()
