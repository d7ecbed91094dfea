# SPDX-License-Identifier: Apache-2.0
"""Scattering of radio Gaussians on the CPU: forward sum and hand-derived gradients.

For Gaussian i, link l and subcarrier f (wavenumber k) the term without its gain is

    A z(f),  A = v / (d_t d_r),  z = exp(-k^2 Q / 2 - j k d),  d = d_t + d_r,  Q = q^T Sigma q.

Subcarriers are uniform, so z(f + df) = z(f) r(f) and r(f + df) = r(f) (1 + e), with r complex and
e = exp(-dk^2 Q) - 1 real: eight multiplications and additions per term instead of three
transcendental functions. Gaussians are processed in blocks of `BLOCK`, the innermost loops run
over the block and become SIMD code, and the recurrence starts afresh at every chunk of subcarriers.
Within a chunk the gain is a polynomial in the subcarrier's offset from the chunk's centre, kappa:
gain = sum_j gain_j kappa^j, so that knots of gamma stay out of the loops.

Sums run in a fixed order (a link's sum in one thread, a Gaussian's gradient in one thread), so
results do not depend on the number of threads.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.vector_math import (
    BLOCK,
    FAST_MATH,
    FAST_REDUCTION,
    exponential,
    scratch,
    sine_cosine_of_turns,
    six_rows,
    three_rows,
)

#: Subcarriers handled in one pass over a block; chunks are padded to a multiple of it.
UNROLL = 4
#: Exponents below this are taken as zero: e^-60 = 1e-26. It keeps denormal numbers, which the
#: processor handles very slowly, out of the recurrence.
LOWEST_EXPONENT = -60.0

_PER_METRE = 1.0 / SPEED_OF_LIGHT
WAVENUMBER = 2.0 * np.pi / SPEED_OF_LIGHT
#: Rows of the work array, one number per Gaussian of the block in each.
AMPLITUDE, SPREAD, ZR, ZI, RR, RI, E = range(7)
UTX, UTY, UTZ, URX, URY, URZ, INV_T, INV_R, HIDE_T, HIDE_R, SEEN = range(7, 18)
BY_AMPLITUDE, BY_DISTANCE, BY_SPREAD, MOMENTS = 18, 19, 20, 21
ROWS = MOMENTS + 6

OPTIONS: dict[str, Any] = {"fastmath": FAST_MATH, "cache": True, "error_model": "numpy"}
_SUM_OPTIONS: dict[str, Any] = OPTIONS | {"fastmath": FAST_REDUCTION}


class Cloud(NamedTuple):
    """Gaussians as kernels read them; `real` is the precision of the sums."""

    means: np.ndarray
    """Centres [m], float64 [3, gaussian]."""
    shape: np.ndarray
    """Covariances xx, yy, zz, xy, xz, yz [m^2], real [6, gaussian]."""
    gain: np.ndarray
    """Polynomials of the gain, real [piece, order, re/im, gaussian]."""
    visibility: np.ndarray
    """Weights, real [group, gaussian]."""
    normals: np.ndarray
    """Unit normals, real [3, gaussian], or [3, 0] where every Gaussian is seen from all sides."""
    sharpness: float
    """Slope of the visibility around the tangent plane."""


class Plan(NamedTuple):
    """Links and chunks of subcarriers."""

    ends: np.ndarray
    """Positions of both antennas [m], float64 [link, 6]."""
    group: np.ndarray
    """Row of `Cloud.visibility` per link, int64 [link]."""
    chunk: np.ndarray
    """First output column, padded subcarriers and gain piece per chunk, int64 [chunk, 3]."""
    subcarrier: np.ndarray
    """First frequency, spacing, centre frequency [Hz] and centre offset, float64 [chunk, 4]."""


@njit(forceinline=True, **OPTIONS)
def illuminate(
    cloud: Cloud, end: np.ndarray, first: int, n: int, distance: np.ndarray, w: np.ndarray
) -> None:
    """Path lengths, unit vectors, spread Q and 1 / (d_t d_r) of one block and link."""
    real = w.dtype.type
    px, py, pz = three_rows(cloud.means, first, n)
    one = real(1.0)
    for b in range(n):
        # Lengths in double for the phase; float32 is enough for directions.
        x, y, z = end[0] - px[b], end[1] - py[b], end[2] - pz[b]
        length = math.sqrt(x * x + y * y + z * z)
        inverse = one / real(length)
        w[UTX, b], w[UTY, b], w[UTZ, b] = real(x) * inverse, real(y) * inverse, real(z) * inverse
        w[INV_T, b], distance[b] = inverse, length
    for b in range(n):
        x, y, z = end[3] - px[b], end[4] - py[b], end[5] - pz[b]
        length = math.sqrt(x * x + y * y + z * z)
        inverse = one / real(length)
        w[URX, b], w[URY, b], w[URZ, b] = real(x) * inverse, real(y) * inverse, real(z) * inverse
        w[INV_R, b] = inverse
        distance[b] += length
    sxx, syy, szz, sxy, sxz, syz = six_rows(cloud.shape, first, n)
    for b in range(n):
        qx, qy, qz = w[UTX, b] + w[URX, b], w[UTY, b] + w[URY, b], w[UTZ, b] + w[URZ, b]
        mixed = qx * qy * sxy[b] + qx * qz * sxz[b] + qy * qz * syz[b]
        squares = qx * qx * sxx[b] + qy * qy * syy[b] + qz * qz * szz[b]
        w[SPREAD, b] = squares + mixed + mixed
        w[AMPLITUDE, b] = w[INV_T, b] * w[INV_R, b]


@njit(forceinline=True, **OPTIONS)
def see(cloud: Cloud, group: int, first: int, n: int, w: np.ndarray) -> None:
    """Multiplies the amplitude by the visibility; keeps what its gradient needs."""
    one = w.dtype.type(1.0)
    visibility = cloud.visibility[group, first : first + n]
    if cloud.normals.shape[1] == 0:
        for b in range(n):
            w[SEEN, b] = one
    else:
        nx, ny, nz = three_rows(cloud.normals, first, n)
        slope = w.dtype.type(-cloud.sharpness)
        for b in range(n):
            by_tx = slope * (nx[b] * w[UTX, b] + ny[b] * w[UTY, b] + nz[b] * w[UTZ, b])
            by_rx = slope * (nx[b] * w[URX, b] + ny[b] * w[URY, b] + nz[b] * w[URZ, b])
            s_t, s_r = one / (one + exponential(by_tx)), one / (one + exponential(by_rx))
            w[HIDE_T, b], w[HIDE_R, b] = one - s_t, one - s_r
            w[SEEN, b] = s_t * s_r
            w[AMPLITUDE, b] *= w[SEEN, b]
    for b in range(n):
        w[AMPLITUDE, b] *= visibility[b]


@njit(forceinline=True, **OPTIONS)
def start_subcarriers(subcarrier: np.ndarray, n: int, distance: np.ndarray, w: np.ndarray) -> None:
    """Sets z, r and e at the first subcarrier of a chunk."""
    real = w.dtype.type
    k, dk = WAVENUMBER * subcarrier[0], WAVENUMBER * subcarrier[1]
    start, step, bend = real(-0.5 * k * k), real(-0.5 * dk * (2 * k + dk)), real(-dk * dk)
    lowest, zero, one = real(LOWEST_EXPONENT), real(0.0), real(1.0)
    half, sixth, small = real(0.5), real(1.0 / 6.0), real(-1e-2)
    cycles, cycles_step = subcarrier[0] * _PER_METRE, subcarrier[1] * _PER_METRE
    for b in range(n):
        turns = distance[b] * cycles
        s, c = sine_cosine_of_turns(real(turns - np.floor(turns + 0.5)))
        x = start * w[SPREAD, b]
        g = exponential(x) if x > lowest else zero
        w[ZR, b], w[ZI, b] = g * c, -g * s
        turns = distance[b] * cycles_step
        s, c = sine_cosine_of_turns(real(turns - np.floor(turns + 0.5)))
        g = exponential(step * w[SPREAD, b])
        w[RR, b], w[RI, b] = g * c, -g * s
        x = bend * w[SPREAD, b]
        # exp(x) - 1 without cancellation: errors of r grow with the square of the chunk.
        near = x * (one + x * (half + x * sixth))
        w[E, b] = near if x > small else exponential(x) - one


@njit(forceinline=True, **OPTIONS)
def _gain(gain: np.ndarray, first: int, n: int, w: np.ndarray) -> None:
    """Multiplies z by amplitude and gain."""
    gain_r, gain_i = gain[0, first : first + n], gain[1, first : first + n]
    for b in range(n):
        a, x, y = w[AMPLITUDE, b], w[ZR, b], w[ZI, b]
        g, h = gain_r[b], gain_i[b]
        w[ZR, b], w[ZI, b] = a * (g * x - h * y), a * (g * y + h * x)


@njit(inline="always", **OPTIONS)
def turn(x: float, y: float, u: float, v: float, e: float) -> Any:
    """One step of the recurrence: z r and r (1 + e)."""
    return x * u - y * v, x * v + y * u, u + u * e, v + v * e


@njit(forceinline=True, **_SUM_OPTIONS)
def _sum_subcarriers(
    n: int,
    zr: np.ndarray,
    zi: np.ndarray,
    rr: np.ndarray,
    ri: np.ndarray,
    e: np.ndarray,
    out: np.ndarray,
) -> None:
    """Adds the block's sum of z to out[re/im, subcarrier], moving z and r on."""
    for m in range(0, out.shape[1], UNROLL):
        r0 = r1 = r2 = r3 = i0 = i1 = i2 = i3 = zr.dtype.type(0.0)
        for b in range(n):
            x, y, u, v, s = zr[b], zi[b], rr[b], ri[b], e[b]
            r0 += x
            i0 += y
            x, y, u, v = turn(x, y, u, v, s)
            r1 += x
            i1 += y
            x, y, u, v = turn(x, y, u, v, s)
            r2 += x
            i2 += y
            x, y, u, v = turn(x, y, u, v, s)
            r3 += x
            i3 += y
            zr[b], zi[b], rr[b], ri[b] = turn(x, y, u, v, s)
        out[0, m] += r0
        out[1, m] += i0
        out[0, m + 1] += r1
        out[1, m + 1] += i1
        out[0, m + 2] += r2
        out[1, m + 2] += i2
        out[0, m + 3] += r3
        out[1, m + 3] += i3


@njit(parallel=True, **OPTIONS)
def scatter_forward(cloud: Cloud, plan: Plan, out: np.ndarray) -> None:
    """Writes sum_i A z kappa-coefficients, float64 out[link, order, re/im, padded subcarrier]."""
    total = cloud.means.shape[1]
    for link in prange(plan.ends.shape[0]):
        w, distance = scratch(ROWS, cloud.shape), scratch(1, cloud.means)[0]
        for first in range(0, total, BLOCK):
            n = min(BLOCK, total - first)
            illuminate(cloud, plan.ends[link], first, n, distance, w)
            see(cloud, plan.group[link], first, n, w)
            for c in range(plan.chunk.shape[0]):
                column, count, piece = plan.chunk[c]
                for order in range(cloud.gain.shape[1]):
                    start_subcarriers(plan.subcarrier[c], n, distance, w)
                    _gain(cloud.gain[piece, order], first, n, w)
                    part = out[link, order, :, column : column + count]
                    _sum_subcarriers(n, w[ZR], w[ZI], w[RR], w[RI], w[E], part)
