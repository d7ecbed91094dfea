# SPDX-License-Identifier: Apache-2.0
"""Shadows of Gaussians on path legs on a GPU: product and hand-derived gradients.

The formulas and precisions are those of `kernels_shadow`: positions and projected covariances in
double, since the determinant of a thin Gaussian seen edge-on cancels, all else in single. Sums and
products run in a fixed order, so the same device gives the same bytes.
"""

from __future__ import annotations

import triton
import triton.language as tl

from rfgs_core.propagation.fresnel import EDGE_M
from rfgs_core.propagation.triton_math import plus, sine_cosine_of_turns, store_three, three_rows

#: Legs and Gaussians of one tile of the product; Gaussians of one tile of its gradient.
LEGS, SCREENS, SLOPES = 4, 64, 64
#: Columns of a leg: `LegFrames.table`, then wavelength over 2 pi times the unfolded length.
COLUMNS = 16
#: Rows of the gradient: positions, covariances, opacity.
BY_SHAPE, BY_ALPHA, GRADIENTS = 3, 9, 10

_COLUMNS, _SHAPE, _ALPHA = tl.constexpr(COLUMNS), tl.constexpr(BY_SHAPE), tl.constexpr(BY_ALPHA)
_PER_EDGE = tl.constexpr(1.0 / EDGE_M)
#: As in `kernels_shadow`: keeps divisions finite.
_TINY = tl.constexpr(1e-36)
#: -1 / (4 pi): from rho^T v to turns.
_TO_TURNS = tl.constexpr(-0.07957747154594767)


@triton.jit
def _vector(leg, mask):
    return (
        tl.load(leg, mask, other=0.0),
        tl.load(leg + 1, mask, other=0.0),
        tl.load(leg + 2, mask, other=0.0),
    )


@triton.jit
def _fade(x):
    """Smooth step 3x^2 - 2x^3 from 0 to 1, and its slope."""
    x = tl.minimum(tl.maximum(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


@triton.jit
def _along(leg, mask, px, py, pz):
    """Kappa, its slope, fade and its slope of Gaussians along a leg."""
    ax, ay, az = _vector(leg, mask)
    ux, uy, uz = _vector(leg + 3, mask)
    length = tl.load(leg + 12, mask, other=0.0).to(tl.float32)
    before = tl.load(leg + 13, mask, other=0.0).to(tl.float32)
    behind = tl.load(leg + 14, mask, other=0.0).to(tl.float32)
    scale = tl.load(leg + 15, mask, other=0.0).to(tl.float32)
    t = ((px - ax) * ux + (py - ay) * uy + (pz - az) * uz).to(tl.float32)
    inside = tl.minimum(tl.maximum(t, 0.0), length)
    d1, d2 = before + inside, behind + length - inside
    rise, rise_slope = _fade(t * _PER_EDGE)
    fall, fall_slope = _fade((length - t) * _PER_EDGE)
    edge_slope = _PER_EDGE * (rise_slope * fall - rise * fall_slope)
    return scale * d1 * d2, scale * (d2 - d1), rise * fall, edge_slope


@triton.jit
def _form(xx, yy, zz, xy, xz, yz, vx, vy, vz, ux, uy, uz):
    """v^T A u of a symmetric A."""
    first = vx * (xx * ux + xy * uy + xz * uz)
    return first + vy * (xy * ux + yy * uy + yz * uz) + vz * (xz * ux + yz * uy + zz * uz)


@triton.jit
def _across(leg, mask, px, py, pz, sxx, syy, szz, sxy, sxz, syz):
    """Offset, projected covariance and its determinant of Gaussians across a leg."""
    ax, ay, az = _vector(leg, mask)
    fx, fy, fz = _vector(leg + 6, mask)
    gx, gy, gz = _vector(leg + 9, mask)
    x = (px - ax) * fx + (py - ay) * fy + (pz - az) * fz
    y = (px - ax) * gx + (py - ay) * gy + (pz - az) * gz
    xx = _form(sxx, syy, szz, sxy, sxz, syz, fx, fy, fz, fx, fy, fz)
    yy = _form(sxx, syy, szz, sxy, sxz, syz, gx, gy, gz, gx, gy, gz)
    xy = _form(sxx, syy, szz, sxy, sxz, syz, fx, fy, fz, gx, gy, gz)
    det = tl.abs(xx * yy - xy * xy).to(tl.float32)
    x, y = x.to(tl.float32), y.to(tl.float32)
    return x, y, xx.to(tl.float32), yy.to(tl.float32), xy.to(tl.float32), det


@triton.jit
def _times(a, b, c, d):
    """(a + jb)(c + jd)."""
    return a * c - b * d, a * d + b * c


@triton.jit
def _blob(x, y, kappa, xx, yy, xy, det):
    """One blob's g, 1 / det C and v = C^-1 rho_0, each as real and imaginary part."""
    p, q = det - kappa * kappa, kappa * (xx + yy)
    norm = 1.0 / (p * p + q * q + _TINY)
    mr, mi = p * norm, q * norm
    vxr, vxi = _times(mr, mi, yy * x - xy * y, -kappa * x)
    vyr, vyi = _times(mr, mi, xx * y - xy * x, -kappa * y)
    # Principal root of det S / det C, in the upper half plane; nothing cancels.
    ar, ai = det * mr, det * mi
    large = tl.sqrt(0.5 * (tl.sqrt(ar * ar + ai * ai) + tl.abs(ar)))
    small = 0.5 * ai / (large + _TINY)
    root_r, root_i = tl.where(ar > 0.0, large, small), tl.where(ar > 0.0, small, large)
    turns = (x * vxi + y * vyi) * _TO_TURNS
    sine, cosine = sine_cosine_of_turns(turns - tl.floor(turns + 0.5))
    u, v = yy * x * x + xx * y * y - 2.0 * xy * x * y, kappa * (x * x + y * y)
    level = tl.exp(tl.minimum(-0.5 * (u * p + v * q) * norm, 0.0))
    gr, gi = _times(root_r, root_i, level * cosine, level * sine)
    return gr, gi, mr, mi, vxr, vxi, vyr, vyi


@triton.jit(do_not_specialize=["total", "legs_out", "per_split"])
def shadow_forward(
    means, shape, alpha, legs, out, total, legs_out, per_split,
    LEGS: tl.constexpr, SCREENS: tl.constexpr,
):  # fmt: skip
    """Writes out[split, re/im, leg, SCREENS]: factors of a split, still to be multiplied."""
    split, lane = tl.program_id(1), tl.arange(0, SCREENS)[None, :]
    path = (tl.program_id(0) * LEGS + tl.arange(0, LEGS))[:, None]
    known = path < legs_out
    leg = legs + _COLUMNS * path
    real, imaginary = (
        tl.full([LEGS, SCREENS], 1.0, tl.float32),
        tl.zeros([LEGS, SCREENS], tl.float32),
    )
    for first in range(split * per_split, tl.minimum(total, (split + 1) * per_split), SCREENS):
        row = first + lane
        mask = row < total
        px, py, pz = three_rows(means, row, mask, total, 0.0)
        xx, yy, zz = three_rows(shape, row, mask, total, 0.0)
        xy, xz, yz = three_rows(shape + 3 * total, row, mask, total, 0.0)
        kappa, _, edge, _ = _along(leg, known, px, py, pz)
        x, y, s, t, m, det = _across(leg, known, px, py, pz, xx, yy, zz, xy, xz, yz)
        gr, gi, _, _, _, _, _, _ = _blob(x, y, kappa, s, t, m, det)
        weight = tl.load(alpha + row, mask, other=0.0) * edge
        real, imaginary = _times(real, imaginary, 1.0 - weight * gr, -weight * gi)
    place = out + ((2 * split * legs_out + path) * SCREENS).to(tl.int64) + lane
    tl.store(place, real, known)
    tl.store(place + (legs_out * SCREENS).to(tl.int64), imaginary, known)


@triton.jit
def _slopes(seed_r, seed_i, a, edge, x, y, kappa, xx, yy, xy, det):
    """Gradients with respect to alpha, fade, offset, projected covariance and kappa.

    As `kernels_shadow._differentiate` derives them; the seed is conj(dL/dT) T.
    """
    gr, gi, mr, mi, vxr, vxi, vyr, vyi = _blob(x, y, kappa, xx, yy, xy, det)
    cr, ci = 1.0 - a * edge * gr, -a * edge * gi
    norm = -1.0 / (cr * cr + ci * ci + _TINY)
    hr, hi = _times(seed_r, seed_i, cr * norm, -ci * norm)
    hr, hi = _times(hr, hi, gr, gi)
    by_alpha, by_edge = hr * edge, hr * a
    hr, hi = hr * a * edge, hi * a * edge
    by_x, by_y = hi * vxi - hr * vxr, hi * vyi - hr * vyr
    inverse = 1.0 / (det + _TINY)
    sqr, sqi = _times(vxr, vxi, vxr, vxi)
    tqr, tqi = _times(vyr, vyi, vyr, vyi)
    mixr, mixi = _times(vxr, vxi, vyr, vyi)
    pr, pi = _times(mr, mi, yy, -kappa)
    qr, qi = _times(mr, mi, xx, -kappa)
    by_xx = 0.5 * (hr * (yy * inverse - pr + sqr) - hi * (sqi - pi))
    by_yy = 0.5 * (hr * (xx * inverse - qr + tqr) - hi * (tqi - qi))
    by_xy = hr * (xy * (mr - inverse) + mixr) - hi * (xy * mi + mixi)
    by_kappa = -0.5 * (hr * (pi + qi - sqi - tqi) + hi * (pr + qr - sqr - tqr))
    return by_alpha, by_edge, by_x, by_y, by_xx, by_yy, by_xy, by_kappa


@triton.jit
def _single(leg):
    x, y, z = tl.load(leg), tl.load(leg + 1), tl.load(leg + 2)
    return x.to(tl.float32), y.to(tl.float32), z.to(tl.float32)


@triton.jit(do_not_specialize=["total", "legs_in", "per_split"])
def shadow_backward(
    means, shape, alpha, legs, seed, out, total, legs_in, per_split,
    SLOPES: tl.constexpr, GRADIENTS: tl.constexpr,
):  # fmt: skip
    """Writes out[split, GRADIENTS, gaussian], given seed[leg, re/im] = conj(dL/dT) T."""
    split, row = tl.program_id(1), tl.program_id(0) * SLOPES + tl.arange(0, SLOPES)
    mask = row < total
    px, py, pz = three_rows(means, row, mask, total, 0.0)
    xx, yy, zz = three_rows(shape, row, mask, total, 0.0)
    xy, xz, yz = three_rows(shape + 3 * total, row, mask, total, 0.0)
    a = tl.load(alpha + row, mask, other=0.0)
    none = tl.zeros([SLOPES], tl.float32)
    gx, gy, gz, gxx, gyy, gzz, gxy, gxz, gyz, by_a = (none,) * 10
    for path in range(split * per_split, tl.minimum(legs_in, (split + 1) * per_split)):
        leg = legs + _COLUMNS * path
        kappa, kappa_slope, edge, edge_slope = _along(leg, True, px, py, pz)
        x, y, s, t, m, det = _across(leg, True, px, py, pz, xx, yy, zz, xy, xz, yz)
        seed_r, seed_i = tl.load(seed + 2 * path), tl.load(seed + 2 * path + 1)
        by_alpha, by_edge, by_x, by_y, by_s, by_t, by_m, by_kappa = _slopes(
            seed_r, seed_i, a, edge, x, y, kappa, s, t, m, det
        )
        by_a += by_alpha
        ux, uy, uz = _single(leg + 3)
        fx, fy, fz = _single(leg + 6)
        hx, hy, hz = _single(leg + 9)
        gx, gy, gz = plus(gx, gy, gz, by_kappa * kappa_slope + by_edge * edge_slope, ux, uy, uz)
        gx, gy, gz = plus(gx, gy, gz, by_x, fx, fy, fz)
        gx, gy, gz = plus(gx, gy, gz, by_y, hx, hy, hz)
        gxx, gyy, gzz = plus(gxx, gyy, gzz, by_s, fx * fx, fy * fy, fz * fz)
        gxx, gyy, gzz = plus(gxx, gyy, gzz, by_t, hx * hx, hy * hy, hz * hz)
        gxx, gyy, gzz = plus(gxx, gyy, gzz, by_m, fx * hx, fy * hy, fz * hz)
        gxy, gxz, gyz = plus(gxy, gxz, gyz, 2.0 * by_s, fx * fy, fx * fz, fy * fz)
        gxy, gxz, gyz = plus(gxy, gxz, gyz, 2.0 * by_t, hx * hy, hx * hz, hy * hz)
        gxy, gxz, gyz = plus(
            gxy, gxz, gyz, by_m, fx * hy + fy * hx, fx * hz + fz * hx, fy * hz + fz * hy
        )
    base = out + (split * GRADIENTS).to(tl.int64) * total
    store_three(base, row, mask, total, gx, gy, gz)
    store_three(base + _SHAPE * total, row, mask, total, gxx, gyy, gzz)
    store_three(base + (_SHAPE + 3) * total, row, mask, total, gxy, gxz, gyz)
    tl.store(base + _ALPHA * total + row, by_a, mask)
