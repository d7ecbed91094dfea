# SPDX-License-Identifier: Apache-2.0
"""The channel change at a frame's packets, its own time first, estimated from all of them.

Somebody who moves turns the channel from packet to packet at a few Doppler frequencies, is met at
a few delays and seen in a few directions; thermal noise is everywhere alike. Per device pair the
change y becomes cells: directions of the arrays × delays, a unitary transform of the visible
entries. A cell's packets y_n are a stationary process of spectrum S in noise of power σ²,
and the linear estimate of least mean squared error is

    x̂ = R (R + σ² I)⁻¹ y,   R[n, m] = r(n − m),   r(k) = mean over ν of S(ν) e^{+j2πkν},

the Wiener filter (N. Wiener, Extrapolation, Interpolation and Smoothing of Stationary Time Series,
1949). A filter per Doppler bin, max(0, 1 − σ²/P), is its limit for many packets; at the first
packet, an end of the record, that limit does not hold, because bins take the record for a period.

All that enters comes from the data: σ² is the median power of the cells of all delays and Dopplers
(people fill few of them), S what the periodogram, averaged over neighbouring cells, has above σ²
where noise alone would hardly reach it. Lost packets are left out of y.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex, Complex64, Float
from scipy.ndimage import uniform_filter1d
from scipy.special import gammainccinv

from rfgs_core.radio import Layout
from rfgs_core.radio.delay import hann

#: Doppler frequencies per resolved one at which spectra are held.
DOPPLER_GRID = 2
#: Neighbouring cells, along each axis, that a periodogram is averaged over.
NEIGHBOURS = 3
#: Share of the cells of noise alone that are taken for somebody.
FALSE_ALARMS = 1e-5
#: Noise below this share of a pair's power leaves its packets as they are.
SILENT = 1e-5
#: Cells that are solved at once.
_CELLS = 1024


def noise_power(
    change: Complex[np.ndarray, "packet link subcarrier"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
) -> float:
    """Power of what has no delay and no Doppler of its own: white noise of one entry.

    The median over delay–Doppler cells of exponentially distributed powers is ln 2 of their mean.
    Hann windows keep the side lobes of strong echoes from passing for noise.

    Args:
        change: Channel change; packets evenly spaced.
        subcarriers: Visible subcarriers; the longest run of them is read.
    """
    index = np.flatnonzero(subcarriers)
    run = max(np.split(index, np.flatnonzero(np.diff(index) > 1) + 1), key=len)
    band, time = (hann(size) for size in (len(run), len(change)))
    window = band * time[:, None, None] / np.sqrt((band**2).sum() * (time**2).sum())
    cells = np.fft.fft(np.fft.fft(change[:, :, run] * window, axis=2), axis=0)
    return float(np.median(cells.real**2 + cells.imag**2) / np.log(2.0))


def doppler_spectrum(
    cells: Complex[np.ndarray, "packet *cell"], noise: float, count: int
) -> Float[np.ndarray, "doppler *cell"]:
    """Power over Doppler of each cell without noise, zero where noise may be all there is.

    Args:
        cells: Channel change by direction and delay; zero where a packet was lost.
        noise: Power of the noise in a cell of one packet.
        count: Packets that were received.

    Returns:
        Spectra of mean r(0) on `DOPPLER_GRID` × packet frequencies, that of nothing first.
    """
    size = DOPPLER_GRID * len(cells)
    spectrum = np.fft.fft(cells, n=size, axis=0)
    power = (spectrum.real**2 + spectrum.imag**2) / count
    averaged = [min(NEIGHBOURS, length) for length in power.shape]
    for axis, length in enumerate(averaged):
        power = uniform_filter1d(power, length, axis=axis, mode="wrap")
    # Of the Doppler grid only one in DOPPLER_GRID values is independent of the others.
    looks = np.prod(averaged) / DOPPLER_GRID
    heard = power > noise * gammainccinv(looks, FALSE_ALARMS) / looks
    return np.where(heard, power - noise, 0.0)


def wiener_estimate(
    cells: Complex[np.ndarray, "packet cell"],
    spectrum: Float[np.ndarray, "doppler cell"],
    noise: float,
    received: Bool[np.ndarray, "packet"],
) -> Complex64[np.ndarray, "packet cell"]:
    """Wiener's estimate of each cell's packets, lost ones included, see the module."""
    estimate = np.zeros(cells.shape, dtype=np.complex64)
    every, (rows,) = np.arange(len(cells)), np.nonzero(received)
    (heard,) = np.nonzero(spectrum.any(axis=0))
    for part in np.array_split(heard, -(-len(heard) // _CELLS)) if len(heard) else []:
        covariance = np.fft.ifft(spectrum[:, part], axis=0).astype(np.complex64)
        towards = covariance[every[:, None] - rows].transpose(2, 0, 1)
        matrix = towards[:, rows] + np.float32(noise) * np.eye(len(rows), dtype=np.float32)
        weighed = np.linalg.solve(matrix, cells[rows][:, part].T[..., None])
        estimate[:, part] = (towards @ weighed)[..., 0].T
    return estimate


def _columns(rx_column: np.ndarray, rx: np.ndarray) -> tuple[np.ndarray, int]:
    """Receiving elements column by column, and how many a column has; 1 if columns differ."""
    order = rx[np.argsort(rx_column[rx], kind="stable")]
    _, counts = np.unique(rx_column[rx], return_counts=True)
    return order, int(counts[0]) if (counts == counts[0]).all() else 1


def _pair_estimate(
    change: Complex[np.ndarray, "packet tx column row subcarrier"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    received: Bool[np.ndarray, "packet"],
) -> Complex[np.ndarray, "packet tx column row subcarrier"]:
    """The estimate of one device pair."""
    noise = noise_power(change[received].reshape(received.sum(), -1, len(subcarriers)), subcarriers)
    power = float(np.mean(np.abs(change[received][..., subcarriers]) ** 2))
    if received.all() and noise <= SILENT * power:
        return change
    cells = np.fft.ifft(change, axis=4, norm="ortho")
    cells = np.fft.fftn(cells, axes=(1, 2, 3), norm="ortho")
    noise *= float(subcarriers.mean())
    spectrum = doppler_spectrum(cells, noise, int(received.sum()))
    flat = cells.reshape(len(cells), -1), spectrum.reshape(len(spectrum), -1)
    estimate = wiener_estimate(*flat, noise, received).reshape(cells.shape)
    antennas = np.fft.ifftn(estimate, axes=(1, 2, 3), norm="ortho")
    return np.fft.fft(antennas, axis=4, norm="ortho")


def change_of_packets(
    change: Complex64[np.ndarray, "packet tx rx subcarrier"],
    links: Bool[np.ndarray, "tx rx"],
    subcarriers: Bool[np.ndarray, "subcarrier"],
    layout: Layout,
) -> Complex64[np.ndarray, "packet tx rx subcarrier"]:
    """The change of all visible links at each packet, estimated from all of them.

    Args:
        change: csi − csi_static of each packet, evenly spaced; NaN where one was lost.
        links: Links that may be read.
        subcarriers: Subcarriers that may be read.
        layout: Antenna elements.

    Returns:
        Zero where nothing may be read.
    """
    estimate = np.zeros(change.shape, dtype=np.complex64)
    pair, names = layout.pairs_of(links)
    for index in range(len(names)):
        tx, rx = (np.unique(axis) for axis in np.nonzero(pair == index))
        rx, rows = _columns(layout.rx_column, rx)
        visible = links[tx[:, None], rx][..., None] & subcarriers
        block = np.where(visible, change[:, tx[:, None], rx], 0)
        received = np.isfinite(block).all(axis=(1, 2, 3))
        block[~received] = 0
        shape = (*block.shape[:2], -1, rows, len(subcarriers))
        found = _pair_estimate(block.reshape(shape), subcarriers, received)
        estimate[:, tx[:, None], rx] = found.reshape(block.shape)
    return np.where(links[..., None] & subcarriers, estimate, 0).astype(np.complex64)
