# SPDX-License-Identifier: Apache-2.0
"""Gradients of the scattering sum, derived by hand and checked against `gradcheck`.

With G(f) = conj(dL/dH(f)) lambda / (4 pi)^(3/2), one pass over the subcarriers gives the moments
c_n = sum_f G z kappa^n. Everything else follows from them per Gaussian and link: with
S_n = gain c_n and k = k_c + kappa dk,

    dL/dA = Re S_0,    dL/dd = A Im(k_c S_0 + dk S_1),
    dL/dQ = -A/2 Re(k_c^2 S_0 + 2 k_c dk S_1 + dk^2 S_2),    dL/dgain = conj(A c_0).

z is computed again, so memory does not grow with links times subcarriers times Gaussians. Where
only the gain's gradient is asked for, as by the adjoint of the linear model in it, c_0 is enough.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from rfgs_core.propagation.kernels_scatter import (
    AMPLITUDE,
    BY_AMPLITUDE,
    BY_DISTANCE,
    BY_SPREAD,
    HIDE_R,
    HIDE_T,
    INV_R,
    INV_T,
    MOMENTS,
    OPTIONS,
    RI,
    ROWS,
    RR,
    SEEN,
    UNROLL,
    URX,
    URY,
    URZ,
    UTX,
    UTY,
    UTZ,
    WAVENUMBER,
    ZI,
    ZR,
    Cloud,
    E,
    Plan,
    illuminate,
    see,
    start_subcarriers,
    turn,
)
from rfgs_core.vector_math import BLOCK, scratch, six_rows, three_rows


class CloudGradient(NamedTuple):
    """Gradients of the fields of `Cloud`, in the same layout and precision `real`."""

    means: np.ndarray
    shape: np.ndarray
    gain: np.ndarray
    visibility: np.ndarray
    normals: np.ndarray


@njit(inline="always", **OPTIONS)
def _add(x: float, y: float, g: float, h: float, sums: Any) -> Any:
    """Adds one subcarrier, (x + jy)(g + jh), to sums, sums of these, and sums of those.

    Additions alone: moments by multiples of kappa would keep the multipliers busy, which the
    recurrence needs.
    """
    s, t, s1, t1, s2, t2 = sums
    s, t = s + (x * g - y * h), t + (x * h + y * g)
    s1, t1 = s1 + s, t1 + t
    return s, t, s1, t1, s2 + s1, t2 + t1


@njit(forceinline=True, **OPTIONS)
def _moment_subcarriers(n: int, seed: np.ndarray, centre: float, w: np.ndarray) -> None:
    """Moments of a chunk for each Gaussian of the block, moving z and r on."""
    zr, zi, rr, ri, e = w[ZR], w[ZI], w[RR], w[RI], w[E]
    c0, d0, c1 = w[MOMENTS], w[MOMENTS + 1], w[MOMENTS + 2]
    d1, c2, d2 = w[MOMENTS + 3], w[MOMENTS + 4], w[MOMENTS + 5]
    w[MOMENTS:ROWS, :n] = w.dtype.type(0.0)
    for m in range(0, seed.shape[1], UNROLL):
        g0, g1, g2, g3 = seed[0, m], seed[0, m + 1], seed[0, m + 2], seed[0, m + 3]
        h0, h1, h2, h3 = seed[1, m], seed[1, m + 1], seed[1, m + 2], seed[1, m + 3]
        for b in range(n):
            x, y, u, v, s = zr[b], zi[b], rr[b], ri[b], e[b]
            sums = _add(x, y, g0, h0, (c0[b], d0[b], c1[b], d1[b], c2[b], d2[b]))
            x, y, u, v = turn(x, y, u, v, s)
            sums = _add(x, y, g1, h1, sums)
            x, y, u, v = turn(x, y, u, v, s)
            sums = _add(x, y, g2, h2, sums)
            x, y, u, v = turn(x, y, u, v, s)
            sums = _add(x, y, g3, h3, sums)
            zr[b], zi[b], rr[b], ri[b] = turn(x, y, u, v, s)
            c0[b], d0[b], c1[b], d1[b], c2[b], d2[b] = sums
    _about_centre(n, w.dtype.type(seed.shape[1] - centre), w)


@njit(forceinline=True, **OPTIONS)
def _about_centre(n: int, centre: float, w: np.ndarray) -> None:
    """From sums of sums to moments about the centre, so many subcarriers before the end.

    Of the subcarrier j before the end, 1 being the last, they hold j and j (j + 1) / 2 times.
    """
    c0, d0, c1 = w[MOMENTS], w[MOMENTS + 1], w[MOMENTS + 2]
    d1, c2, d2 = w[MOMENTS + 3], w[MOMENTS + 4], w[MOMENTS + 5]
    for b in range(n):
        x, y = centre * c0[b] - c1[b], centre * d0[b] - d1[b]
        c2[b] = centre * (x - c1[b]) + (c2[b] + c2[b]) - c1[b]
        d2[b] = centre * (y - d1[b]) + (d2[b] + d2[b]) - d1[b]
        c1[b], d1[b] = x, y


@njit(forceinline=True, **OPTIONS)
def _first_moment(n: int, seed: np.ndarray, w: np.ndarray) -> None:
    """The moment of order 0 alone."""
    zr, zi, rr, ri, e = w[ZR], w[ZI], w[RR], w[RI], w[E]
    c0, d0 = w[MOMENTS], w[MOMENTS + 1]
    w[MOMENTS : MOMENTS + 2, :n] = w.dtype.type(0.0)
    for m in range(0, seed.shape[1], UNROLL):
        g0, g1, g2, g3 = seed[0, m], seed[0, m + 1], seed[0, m + 2], seed[0, m + 3]
        h0, h1, h2, h3 = seed[1, m], seed[1, m + 1], seed[1, m + 2], seed[1, m + 3]
        for b in range(n):
            x, y, u, v, s = zr[b], zi[b], rr[b], ri[b], e[b]
            p, q = x * g0 - y * h0, x * h0 + y * g0
            x, y, u, v = turn(x, y, u, v, s)
            p, q = p + (x * g1 - y * h1), q + (x * h1 + y * g1)
            x, y, u, v = turn(x, y, u, v, s)
            p, q = p + (x * g2 - y * h2), q + (x * h2 + y * g2)
            x, y, u, v = turn(x, y, u, v, s)
            p, q = p + (x * g3 - y * h3), q + (x * h3 + y * g3)
            zr[b], zi[b], rr[b], ri[b] = turn(x, y, u, v, s)
            c0[b] += p
            d0[b] += q


@njit(forceinline=True, **OPTIONS)
def _contract(
    gain: np.ndarray, subcarrier: np.ndarray, first: int, n: int, w: np.ndarray, by_gain: np.ndarray
) -> None:
    """Adds a chunk's moments to the gradients of gain, A, d and Q."""
    real = w.dtype.type
    k, dk = real(WAVENUMBER * subcarrier[2]), real(WAVENUMBER * subcarrier[1])
    k2, kdk, dk2 = real(-0.5) * k * k, -k * dk, real(-0.5) * dk * dk
    end = first + n
    gain_r, gain_i = gain[0, first:end], gain[1, first:end]
    by_gain_r, by_gain_i = by_gain[0, first:end], by_gain[1, first:end]
    for b in range(n):
        a, g, h = w[AMPLITUDE, b], gain_r[b], gain_i[b]
        x, y = w[MOMENTS, b], w[MOMENTS + 1, b]
        by_gain_r[b] += a * x
        by_gain_i[b] -= a * y
        s0, t0 = g * x - h * y, g * y + h * x
        x, y = w[MOMENTS + 2, b], w[MOMENTS + 3, b]
        s1, t1 = g * x - h * y, g * y + h * x
        s2 = g * w[MOMENTS + 4, b] - h * w[MOMENTS + 5, b]
        w[BY_AMPLITUDE, b] += s0
        w[BY_DISTANCE, b] += a * (k * t0 + dk * t1)
        w[BY_SPREAD, b] += a * (k2 * s0 + kdk * s1 + dk2 * s2)


@njit(inline="always", **OPTIONS)
def _across(x: float, y: float, z: float, ux: float, uy: float, uz: float) -> Any:
    """Part of a vector that is perpendicular to the unit vector u."""
    along = x * ux + y * uy + z * uz
    return x - along * ux, y - along * uy, z - along * uz


@njit(forceinline=True, **OPTIONS)
def _chain_shape(shape: np.ndarray, first: int, n: int, w: np.ndarray, grad: CloudGradient) -> None:
    """From d, Q and 1 / (d_t d_r) to positions and covariances.

    With u the unit vector towards an antenna at distance d: dd/dp = -u, du/dp = -(I - u u^T)/d.
    """
    sxx, syy, szz, sxy, sxz, syz = six_rows(shape, first, n)
    gxx, gyy, gzz, gxy, gxz, gyz = six_rows(grad.shape, first, n)
    px, py, pz = three_rows(grad.means, first, n)
    for b in range(n):
        tx, ty, tz, it = w[UTX, b], w[UTY, b], w[UTZ, b], w[INV_T, b]
        rx, ry, rz, ir = w[URX, b], w[URY, b], w[URZ, b], w[INV_R, b]
        by_q, by_d = w[BY_SPREAD, b], w[BY_DISTANCE, b]
        scale = w[BY_AMPLITUDE, b] * w[AMPLITUDE, b]
        qx, qy, qz = tx + rx, ty + ry, tz + rz
        gxx[b] += by_q * qx * qx
        gyy[b] += by_q * qy * qy
        gzz[b] += by_q * qz * qz
        twice = by_q + by_q
        gxy[b] += twice * qx * qy
        gxz[b] += twice * qx * qz
        gyz[b] += twice * qy * qz
        x = twice * (sxx[b] * qx + sxy[b] * qy + sxz[b] * qz)
        y = twice * (sxy[b] * qx + syy[b] * qy + syz[b] * qz)
        z = twice * (sxz[b] * qx + syz[b] * qy + szz[b] * qz)
        x1, y1, z1 = _across(x, y, z, tx, ty, tz)
        x2, y2, z2 = _across(x, y, z, rx, ry, rz)
        near_t, near_r = scale * it - by_d, scale * ir - by_d
        px[b] += near_t * tx + near_r * rx - x1 * it - x2 * ir
        py[b] += near_t * ty + near_r * ry - y1 * it - y2 * ir
        pz[b] += near_t * tz + near_r * rz - z1 * it - z2 * ir


@njit(forceinline=True, **OPTIONS)
def _chain_normals(cloud: Cloud, first: int, n: int, w: np.ndarray, grad: CloudGradient) -> None:
    """From the two sigmoids of the visibility to normals and positions."""
    slope = w.dtype.type(cloud.sharpness)
    normal_x, normal_y, normal_z = three_rows(cloud.normals, first, n)
    gx, gy, gz = three_rows(grad.normals, first, n)
    px, py, pz = three_rows(grad.means, first, n)
    for b in range(n):
        tx, ty, tz, it = w[UTX, b], w[UTY, b], w[UTZ, b], w[INV_T, b]
        rx, ry, rz, ir = w[URX, b], w[URY, b], w[URZ, b], w[INV_R, b]
        scale = slope * w[BY_AMPLITUDE, b] * w[AMPLITUDE, b]
        by_t, by_r = scale * w[HIDE_T, b], scale * w[HIDE_R, b]
        gx[b] += by_t * tx + by_r * rx
        gy[b] += by_t * ty + by_r * ry
        gz[b] += by_t * tz + by_r * rz
        nx, ny, nz = normal_x[b], normal_y[b], normal_z[b]
        x1, y1, z1 = _across(nx, ny, nz, tx, ty, tz)
        x2, y2, z2 = _across(nx, ny, nz, rx, ry, rz)
        by_t, by_r = by_t * it, by_r * ir
        px[b] -= by_t * x1 + by_r * x2
        py[b] -= by_t * y1 + by_r * y2
        pz[b] -= by_t * z1 + by_r * z2


@njit(forceinline=True, **OPTIONS)
def _chain_visibility(group: int, first: int, n: int, w: np.ndarray, grad: CloudGradient) -> None:
    """From the amplitude to the weight of the link's group."""
    target = grad.visibility[group, first : first + n]
    for b in range(n):
        target[b] += w[BY_AMPLITUDE, b] * w[INV_T, b] * w[INV_R, b] * w[SEEN, b]


@njit(parallel=True, **OPTIONS)
def scatter_backward(cloud: Cloud, plan: Plan, seed: np.ndarray, grad: CloudGradient) -> None:
    """Adds to `grad`, given seed[link, order, re/im, padded subcarrier] = G kappa^order."""
    total = cloud.means.shape[1]
    for block in prange((total + BLOCK - 1) // BLOCK):
        w, distance = scratch(ROWS, cloud.shape), scratch(1, cloud.means)[0]
        first = block * BLOCK
        n = min(BLOCK, total - first)
        for link in range(plan.ends.shape[0]):
            illuminate(cloud, plan.ends[link], first, n, distance, w)
            see(cloud, plan.group[link], first, n, w)
            w[BY_AMPLITUDE:MOMENTS, :n] = 0.0
            for c in range(plan.chunk.shape[0]):
                column, count, piece = plan.chunk[c]
                subcarrier = plan.subcarrier[c]
                for order in range(cloud.gain.shape[1]):
                    start_subcarriers(subcarrier, n, distance, w)
                    part = seed[link, order, :, column : column + count]
                    _moment_subcarriers(n, part, subcarrier[3], w)
                    _contract(
                        *(cloud.gain[piece, order], subcarrier, first, n, w),
                        grad.gain[piece, order],
                    )
            _chain_shape(cloud.shape, first, n, w, grad)
            _chain_visibility(plan.group[link], first, n, w, grad)
            if cloud.normals.shape[1] > 0:
                _chain_normals(cloud, first, n, w, grad)


@njit(parallel=True, **OPTIONS)
def gain_backward(cloud: Cloud, plan: Plan, seed: np.ndarray, by_gain: np.ndarray) -> None:
    """Adds the gradient of the gain alone, in the layout of `Cloud.gain`; `seed` as above."""
    total = cloud.means.shape[1]
    for block in prange((total + BLOCK - 1) // BLOCK):
        w, distance = scratch(ROWS, cloud.shape), scratch(1, cloud.means)[0]
        first = block * BLOCK
        n = min(BLOCK, total - first)
        for link in range(plan.ends.shape[0]):
            illuminate(cloud, plan.ends[link], first, n, distance, w)
            see(cloud, plan.group[link], first, n, w)
            for c in range(plan.chunk.shape[0]):
                column, count, piece = plan.chunk[c]
                for order in range(cloud.gain.shape[1]):
                    start_subcarriers(plan.subcarrier[c], n, distance, w)
                    _first_moment(n, seed[link, order, :, column : column + count], w)
                    real = by_gain[piece, order, 0, first : first + n]
                    imaginary = by_gain[piece, order, 1, first : first + n]
                    for b in range(n):
                        real[b] += w[AMPLITUDE, b] * w[MOMENTS, b]
                        imaginary[b] -= w[AMPLITUDE, b] * w[MOMENTS + 1, b]
