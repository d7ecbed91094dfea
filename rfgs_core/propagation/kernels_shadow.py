# SPDX-License-Identifier: Apache-2.0
"""Shadows of Gaussians on path legs on the CPU: product and hand-derived gradients.

T = prod_i (1 - alpha_i e_i g_i) per path, g from `rfgs_core.propagation.fresnel` and e the fade
at the ends of the leg. Positions and projected covariances are taken in double: det S of a thin
Gaussian seen edge-on cancels. The rest runs in the precision of the Gaussians, over blocks of
`BLOCK` of them from which those without a shadow are removed first.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from rfgs_core.propagation.fresnel import EDGE_M
from rfgs_core.vector_math import (
    BLOCK,
    FAST_MATH,
    exponential,
    scratch,
    sine_cosine_of_turns,
    six_rows,
    three_rows,
)

#: Below this exponent a shadow is left out: e^-18 = 1.5e-8.
LOWEST_EXPONENT = -18.0
#: Keeps divisions finite, where `max` would keep the compiler from making vector code; squared
#: determinants of any blob over a tenth of a millimetre lie far above it.
_TINY = 1e-36
#: Products below this are zero: no denormal numbers, which the processor handles very slowly.
_LEAST = 1e-15

#: Rows of the work array, one number per Gaussian of the block in each.
_X, _Y, _KAPPA, _SLOPE, _EDGE, _EDGE_SLOPE, _ALPHA, _XX, _YY, _XY, _DET, _LOG = range(12)
_ROWS = 12

_OPTIONS: Any = {"fastmath": FAST_MATH, "cache": True, "error_model": "numpy"}


class Screens(NamedTuple):
    """Gaussians as kernels read them; also holds their gradients."""

    means: np.ndarray
    """Centres [m], float64 [3, gaussian]."""
    shape: np.ndarray
    """Covariances xx, yy, zz, xy, xz, yz [m^2], float64 [6, gaussian]."""
    alpha: np.ndarray
    """Opacities, real [gaussian]."""


@njit(inline="always", **_OPTIONS)
def _fade(x: Any) -> Any:
    """Smooth step 3x^2 - 2x^3 from 0 to 1 and its slope, in the precision of x."""
    one = type(x)(1.0)
    x = min(max(x, type(x)(0.0)), one)
    return x * x * (one + (one - x) + (one - x)), type(x)(6.0) * x * (one - x)


@njit(inline="always", **_OPTIONS)
def _form(shape: Any, i: int, weights: Any) -> float:
    """Bilinear form of a packed covariance, given the weights of its six entries."""
    a, b, c, d, e, f = weights
    xx, yy, zz, xy, xz, yz = shape
    diagonal = a * xx[i] + b * yy[i] + c * zz[i]
    return diagonal + d * xy[i] + e * xz[i] + f * yz[i]


@njit(forceinline=True, **_OPTIONS)
def _weights(v: np.ndarray, u: np.ndarray) -> Any:
    """Weights of the six packed entries of a symmetric matrix A in v^T A u."""
    mixed = v[0] * u[1] + v[1] * u[0], v[0] * u[2] + v[2] * u[0], v[1] * u[2] + v[2] * u[1]
    return v[0] * u[0], v[1] * u[1], v[2] * u[2], mixed[0], mixed[1], mixed[2]


@njit(forceinline=True, **_OPTIONS)
def _project(
    screens: Screens, leg: np.ndarray, wavelength_m: float, first: int, n: int, w: np.ndarray
) -> None:
    """Offsets, kappa, fade and projected covariances of one block and leg."""
    ax, ay, az, ux, uy, uz, fx, fy, fz, sx, sy, sz, length, before, behind = leg
    px, py, pz = three_rows(screens.means, first, n)
    alpha, real = screens.alpha[first : first + n], w.dtype.type
    zero, end, per_edge = real(0.0), real(length), real(1.0 / EDGE_M)
    scale = real(wavelength_m / (2 * np.pi * max(before + length + behind, 1e-300)))
    before, behind = real(before), real(behind)
    for b in range(n):
        x, y, z = px[b] - ax, py[b] - ay, pz[b] - az
        w[_X, b] = x * fx + y * fy + z * fz
        w[_Y, b] = x * sx + y * sy + z * sz
        t = real(x * ux + y * uy + z * uz)
        inside = min(max(t, zero), end)
        d1, d2 = before + inside, behind + end - inside
        w[_KAPPA, b] = scale * d1 * d2
        w[_SLOPE, b] = scale * (d2 - d1)
        rise, rise_slope = _fade(t * per_edge)
        fall, fall_slope = _fade((end - t) * per_edge)
        w[_EDGE, b] = rise * fall
        w[_EDGE_SLOPE, b] = per_edge * (rise_slope * fall - rise * fall_slope)
        w[_ALPHA, b] = alpha[b]


@njit(forceinline=True, **_OPTIONS)
def _spread(screens: Screens, leg: np.ndarray, first: int, n: int, w: np.ndarray) -> None:
    """Projected covariance, its determinant and the real part of log g's exponent."""
    f2, s2 = _weights(leg[6:9], leg[6:9]), _weights(leg[9:12], leg[9:12])
    fs, half = _weights(leg[6:9], leg[9:12]), w.dtype.type(-0.5)
    tiny = w.dtype.type(_TINY)
    shape = six_rows(screens.shape, first, n)
    for b in range(n):
        xx, yy, xy = _form(shape, b, f2), _form(shape, b, s2), _form(shape, b, fs)
        w[_XX, b], w[_YY, b], w[_XY, b] = xx, yy, xy
        w[_DET, b] = abs(xx * yy - xy * xy)
    for b in range(n):
        x, y, kappa = w[_X, b], w[_Y, b], w[_KAPPA, b]
        xx, yy, xy = w[_XX, b], w[_YY, b], w[_XY, b]
        p, q = w[_DET, b] - kappa * kappa, -kappa * (xx + yy)
        u, v = yy * x * x + xx * y * y - (xy + xy) * x * y, -kappa * (x * x + y * y)
        w[_LOG, b] = half * (u * p + v * q) / (p * p + q * q + tiny)


@njit(forceinline=True, **_OPTIONS)
def _compact(n: int, w: np.ndarray, index: np.ndarray) -> int:
    """Moves the Gaussians that shadow the leg to the left; returns how many there are."""
    count = 0
    for b in range(n):
        count += (w[_EDGE, b] > 0.0) & (w[_LOG, b] > LOWEST_EXPONENT)
    if count == n:
        return n
    kept = 0
    for b in range(n):
        if w[_EDGE, b] > 0.0 and w[_LOG, b] > LOWEST_EXPONENT:
            index[kept] = b
            kept += 1
    for row in range(_ROWS):
        for m in range(kept):
            w[row, m] = w[row, index[m]]
    return kept


@njit(forceinline=True, **_OPTIONS)
def _expand(kept: int, n: int, w: np.ndarray, index: np.ndarray) -> None:
    """Moves what `_compact` kept back to its place; everything else becomes zero."""
    if kept == n:
        return
    for row in range(_ROWS):
        m = kept - 1
        for b in range(n - 1, -1, -1):
            if m >= 0 and index[m] == b:
                w[row, b] = w[row, m]
                m -= 1
            else:
                w[row, b] = 0.0


@njit(inline="always", **_OPTIONS)
def _product(a: float, b: float, c: float, d: float) -> Any:
    """(a + jb)(c + jd)."""
    return a * c - b * d, a * d + b * c


@njit(inline="always", **_OPTIONS)
def _blob(w: np.ndarray, b: int) -> Any:
    """One blob's g, 1 / det C and v = C^-1 rho_0, each as real and imaginary part."""
    real = w.dtype.type
    x, y, kappa, det = w[_X, b], w[_Y, b], w[_KAPPA, b], w[_DET, b]
    xx, yy, xy = w[_XX, b], w[_YY, b], w[_XY, b]
    p, q = det - kappa * kappa, kappa * (xx + yy)
    norm = real(1.0) / (p * p + q * q + real(_TINY))
    mr, mi = p * norm, q * norm
    vxr, vxi = _product(mr, mi, yy * x - xy * y, -kappa * x)
    vyr, vyi = _product(mr, mi, xx * y - xy * x, -kappa * y)

    # Principal root of det S / det C, which lies in the upper half plane; the larger of its
    # parts comes from a sum, the other one from it, so that nothing cancels.
    ar, ai = det * mr, det * mi
    size = math.sqrt(ar * ar + ai * ai)
    large = math.sqrt(real(0.5) * (size + abs(ar)))
    small = real(0.5) * ai / (large + real(_TINY))
    root_r = large if ar > real(0.0) else small
    root_i = small if ar > real(0.0) else large
    turns = (x * vxi + y * vyi) * real(-0.25 / np.pi)
    sine, cosine = sine_cosine_of_turns(real(turns - np.floor(turns + real(0.5))))
    level = exponential(w[_LOG, b])
    gr, gi = _product(root_r, root_i, level * cosine, level * sine)
    return gr, gi, mr, mi, vxr, vxi, vyr, vyi


@njit(forceinline=True, **_OPTIONS)
def _multiply(n: int, w: np.ndarray, tr: np.ndarray, ti: np.ndarray) -> None:
    """Multiplies the running products by 1 - alpha e g; -300 dB and less become zero."""
    one, least = w.dtype.type(1.0), w.dtype.type(_LEAST**2)
    for b in range(n):
        gr, gi, _, _, _, _, _, _ = _blob(w, b)
        weight = w[_ALPHA, b] * w[_EDGE, b]
        x, y = _product(tr[b], ti[b], one - weight * gr, -weight * gi)
        # A factor, not a branch: branches would keep this loop scalar.
        alive = w.dtype.type(x * x + y * y > least)
        tr[b], ti[b] = x * alive, y * alive


@njit(parallel=True, **_OPTIONS)
def shadow_forward(
    screens: Screens, legs: np.ndarray, wavelength_m: float, out: np.ndarray
) -> None:
    """Writes T, float64 out[path, re/im]; `legs` as `LegFrames.table` lays them out."""
    total = screens.means.shape[1]
    for path in prange(legs.shape[0]):
        w = scratch(_ROWS, screens.alpha)
        index = np.zeros(BLOCK, dtype=np.int64)
        tr, ti = scratch(1, screens.alpha)[0], scratch(1, screens.alpha)[0]
        tr[:] = 1.0
        for first in range(0, total, BLOCK):
            n = min(BLOCK, total - first)
            _project(screens, legs[path], wavelength_m, first, n, w)
            _spread(screens, legs[path], first, n, w)
            _multiply(_compact(n, w, index), w, tr, ti)
        x, y = 1.0, 0.0
        for b in range(BLOCK):
            x, y = _product(x, y, tr[b], ti[b])
        out[path, 0], out[path, 1] = x, y


@njit(forceinline=True, **_OPTIONS)
def _differentiate(n: int, w: np.ndarray, seed: np.ndarray) -> None:
    """Replaces X, Y, KAPPA, XX, YY, XY, EDGE and ALPHA by the gradients with respect to them.

    With h = -seed T / (1 - c), c = alpha e g, and log g = (log det S - log det C - rho^T v) / 2:
    d log g = -v^T drho + tr((S^-1 - C^-1 + v v^T) dS) / 2 + j (tr C^-1 - v^T v) dkappa / 2.
    `seed` is the real and imaginary part of conj(dL/dT) T.
    """
    real = w.dtype.type
    half, one, tiny = real(0.5), real(1.0), real(_TINY)
    seed_r, seed_i = seed[0], seed[1]
    for b in range(n):
        gr, gi, mr, mi, vxr, vxi, vyr, vyi = _blob(w, b)
        kappa, xx, yy, xy = w[_KAPPA, b], w[_XX, b], w[_YY, b], w[_XY, b]
        alpha, edge = w[_ALPHA, b], w[_EDGE, b]
        cr, ci = one - alpha * edge * gr, -alpha * edge * gi
        norm = -one / (cr * cr + ci * ci + tiny)
        hr, hi = _product(seed_r, seed_i, cr * norm, -ci * norm)
        hr, hi = _product(hr, hi, gr, gi)
        w[_ALPHA, b], w[_EDGE, b] = hr * edge, hr * alpha
        hr, hi = hr * alpha * edge, hi * alpha * edge
        w[_X, b], w[_Y, b] = hi * vxi - hr * vxr, hi * vyi - hr * vyr

        inverse = one / (w[_DET, b] + tiny)
        sqr, sqi = _product(vxr, vxi, vxr, vxi)
        tqr, tqi = _product(vyr, vyi, vyr, vyi)
        mixr, mixi = _product(vxr, vxi, vyr, vyi)
        # C^-1 = [[yy - j kappa, -xy], [-xy, xx - j kappa]] / det C.
        pr, pi = _product(mr, mi, yy, -kappa)
        qr, qi = _product(mr, mi, xx, -kappa)
        w[_XX, b] = half * (hr * (yy * inverse - pr + sqr) - hi * (sqi - pi))
        w[_YY, b] = half * (hr * (xx * inverse - qr + tqr) - hi * (tqi - qi))
        w[_XY, b] = hr * (xy * (mr - inverse) + mixr) - hi * (xy * mi + mixi)
        trace_r, trace_i = pr + qr - sqr - tqr, pi + qi - sqi - tqi
        w[_KAPPA, b] = -half * (hr * trace_i + hi * trace_r)


@njit(forceinline=True, **_OPTIONS)
def _chain(leg: np.ndarray, first: int, n: int, w: np.ndarray, grad: Any) -> None:
    """From the leg's axes back to positions, covariances and opacities."""
    real = w.dtype.type
    ux, uy, uz = real(leg[3]), real(leg[4]), real(leg[5])
    fx, fy, fz = real(leg[6]), real(leg[7]), real(leg[8])
    sx, sy, sz = real(leg[9]), real(leg[10]), real(leg[11])
    two = real(2.0)
    alpha = grad.alpha[first : first + n]
    px, py, pz = three_rows(grad.means, first, n)
    gxx, gyy, gzz, gxy, gxz, gyz = six_rows(grad.shape, first, n)
    for b in range(n):
        x, y, xx, yy, xy = w[_X, b], w[_Y, b], w[_XX, b], w[_YY, b], w[_XY, b]
        t = w[_KAPPA, b] * w[_SLOPE, b] + w[_EDGE, b] * w[_EDGE_SLOPE, b]
        alpha[b] += w[_ALPHA, b]
        px[b] += x * fx + y * sx + t * ux
        py[b] += x * fy + y * sy + t * uy
        pz[b] += x * fz + y * sz + t * uz
        gxx[b] += xx * fx * fx + yy * sx * sx + xy * fx * sx
        gyy[b] += xx * fy * fy + yy * sy * sy + xy * fy * sy
        gzz[b] += xx * fz * fz + yy * sz * sz + xy * fz * sz
        gxy[b] += two * (xx * fx * fy + yy * sx * sy) + xy * (fx * sy + fy * sx)
        gxz[b] += two * (xx * fx * fz + yy * sx * sz) + xy * (fx * sz + fz * sx)
        gyz[b] += two * (xx * fy * fz + yy * sy * sz) + xy * (fy * sz + fz * sy)


@njit(parallel=True, **_OPTIONS)
def shadow_backward(
    screens: Screens, legs: np.ndarray, wavelength_m: float, seed: np.ndarray, grad: Screens
) -> None:
    """Adds to `grad`, given real seed[path, re/im] = conj(dL/dT) T."""
    total = screens.means.shape[1]
    for block in prange((total + BLOCK - 1) // BLOCK):
        w = scratch(_ROWS, screens.alpha)
        index = np.zeros(BLOCK, dtype=np.int64)
        first = block * BLOCK
        n = min(BLOCK, total - first)
        for path in range(legs.shape[0]):
            if abs(seed[path, 0]) + abs(seed[path, 1]) < _LEAST**2:
                continue
            _project(screens, legs[path], wavelength_m, first, n, w)
            _spread(screens, legs[path], first, n, w)
            kept = _compact(n, w, index)
            _differentiate(kept, w, seed[path])
            _expand(kept, n, w, index)
            _chain(legs[path], first, n, w, grad)
