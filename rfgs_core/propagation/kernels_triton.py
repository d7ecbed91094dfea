# SPDX-License-Identifier: Apache-2.0
"""Scattering of radio Gaussians on a GPU: forward sum and hand-derived gradients.

The formulas are those of `kernels_scatter` and `kernels_scatter_gradient`. Lengths and the turns
of a chunk's first subcarrier are double; everything that exists per link, subcarrier and Gaussian
is single precision and lives in registers. Half precision has no place here: no matrix is
multiplied, and a phase of 10 bits would be worse than the quantisation of a radio. Sums run in a
fixed order, so the same device gives the same bytes.
"""

from __future__ import annotations

import triton
import triton.language as tl

from rfgs_core.propagation.triton_math import plus, sine_cosine_of_turns, store_three, three_rows

#: Gaussians and subcarriers of one tile of the sum: a thread of four warps has one Gaussian, and
#: computes its distances once. Half as many Gaussians take seven times as long on an H100.
ROWS, SUBCARRIERS = 128, 32
#: Gaussians of one tile of the gradient: one per thread.
SCATTER_SLOPES = 128
#: Rows of the gradient: positions, covariances, real and imaginary gain, normals; then groups.
BY_MEANS, BY_SHAPE, BY_GAIN, BY_NORMALS, BY_GROUP = 0, 3, 9, 11, 14

_SHAPE, _GAIN, _NORMALS = tl.constexpr(BY_SHAPE), tl.constexpr(BY_GAIN), tl.constexpr(BY_NORMALS)
_GROUP = tl.constexpr(BY_GROUP)
_TWO_PI = tl.constexpr(6.283185307179586)
#: Where rows behind the last Gaussian stand [m]: nowhere near an antenna.
_FAR_M = tl.constexpr(1e3)


@triton.jit
def _leg(end, px, py, pz):
    """Length (double), unit vector and inverse length (single) from Gaussians to an antenna.

    One step of Newton's method from the root in single precision: a tenth of the time of a root in
    double, and wrong by 1e-14 of the length.
    """
    x, y, z = tl.load(end) - px, tl.load(end + 1) - py, tl.load(end + 2) - pz
    square = x * x + y * y + z * z
    near = tl.sqrt(square.to(tl.float32))
    inverse = 1.0 / near
    root = near.to(tl.float64)
    left = (square - root * root).to(tl.float32)
    return (
        root + (0.5 * inverse * left).to(tl.float64),
        x.to(tl.float32) * inverse,
        y.to(tl.float32) * inverse,
        z.to(tl.float32) * inverse,
        inverse,
    )


@triton.jit
def _spread(shape, row, mask, total, qx, qy, qz):
    """Σ q and q^T Σ q of packed covariances."""
    xx, yy, zz = three_rows(shape, row, mask, total, 0.0)
    xy, xz, yz = three_rows(shape + 3 * total, row, mask, total, 0.0)
    sx, sy, sz = (
        xx * qx + xy * qy + xz * qz,
        xy * qx + yy * qy + yz * qz,
        xz * qx + yz * qy + zz * qz,
    )
    return sx, sy, sz, sx * qx + sy * qy + sz * qz


@triton.jit
def _turns(length_m, cycles_per_m):
    """Turns of a path within half a turn of none: whole ones are dropped in double."""
    turns = length_m * cycles_per_m
    return (turns - tl.floor(turns + 0.5)).to(tl.float32)


# One binary whatever the counts: density control changes them all the time.
@triton.jit(do_not_specialize=["total", "per_split"])
def scatter_forward(
    means,
    shape,
    gain,
    visibility,
    normals,
    ends,
    group,
    subcarrier,
    out,
    total,
    per_split,
    sharpness,
    FACING: tl.constexpr,
    WEIGHED: tl.constexpr,
    ROWS: tl.constexpr,
    SUBCARRIERS: tl.constexpr,
):
    """Writes out[split, link, re/im, chunk, SUBCARRIERS]: sums over a split of the Gaussians.

    Terms add up where they are made; they meet across threads once, at the end.
    """
    link, part, split = tl.program_id(0), tl.program_id(1), tl.program_id(2)
    offset = tl.arange(0, SUBCARRIERS)
    real = tl.zeros([ROWS, SUBCARRIERS], tl.float32)
    imaginary = tl.zeros([ROWS, SUBCARRIERS], tl.float32)
    cycles, step = tl.load(subcarrier + 2 * part), tl.load(subcarrier + 2 * part + 1)
    steps = offset.to(tl.float32)[None, :]
    k = _TWO_PI * (cycles.to(tl.float32) + step.to(tl.float32) * steps)
    falloff = -0.5 * k * k
    for first in range(split * per_split, tl.minimum(total, (split + 1) * per_split), ROWS):
        row = first + tl.arange(0, ROWS)
        mask = row < total
        px, py, pz = three_rows(means, row, mask, total, _FAR_M)
        d_t, tx, ty, tz, by_t = _leg(ends + 6 * link, px, py, pz)
        d_r, rx, ry, rz, by_r = _leg(ends + 6 * link + 3, px, py, pz)
        _, _, _, spread = _spread(shape, row, mask, total, tx + rx, ty + ry, tz + rz)
        weight = by_t * by_r
        if FACING:
            nx, ny, nz = three_rows(normals, row, mask, total, 0.0)
            weight *= tl.sigmoid(sharpness * (nx * tx + ny * ty + nz * tz))
            weight *= tl.sigmoid(sharpness * (nx * rx + ny * ry + nz * rz))
        if WEIGHED:
            weight *= tl.load(visibility + tl.load(group + link) * total + row, mask, other=0.0)
        g = weight * tl.load(gain + row, mask, other=0.0)
        h = weight * tl.load(gain + total + row, mask, other=0.0)
        turns = _turns(d_t + d_r, cycles)[:, None] + _turns(d_t + d_r, step)[:, None] * steps
        sine, cosine = sine_cosine_of_turns(turns - tl.floor(turns + 0.5))
        size = tl.exp(spread[:, None] * falloff)
        real += size * (g[:, None] * cosine + h[:, None] * sine)
        imaginary += size * (h[:, None] * cosine - g[:, None] * sine)
    width = tl.num_programs(1) * SUBCARRIERS
    target = out + ((split * tl.num_programs(0) + link) * 2).to(tl.int64) * width
    tl.store(target + part * SUBCARRIERS + offset, tl.sum(real, axis=0))
    tl.store(target + width + part * SUBCARRIERS + offset, tl.sum(imaginary, axis=0))


@triton.jit
def _perpendicular(x, y, z, ux, uy, uz):
    """Part of a vector that is perpendicular to the unit vector u."""
    along = x * ux + y * uy + z * uz
    return x - along * ux, y - along * uy, z - along * uz


@triton.jit
def _by_echo(length_m, spread, g, h, seed, chunks, subcarrier, SUBCARRIERS: tl.constexpr):
    """Sums over a link's subcarriers for the gain (re, im), the weight, the length and the spread.

    All but that of the weight are for a weight of 1. From one subcarrier to the next a term turns
    and shrinks by a factor that itself shrinks: no sine and no exponential within a chunk.
    """
    p0, p1, p2 = 0.0 * spread, 0.0 * spread, 0.0 * spread
    q0, q1, q2 = p0, p0, p0
    width = chunks * SUBCARRIERS
    for part in range(chunks):
        cycles, step = tl.load(subcarrier + 2 * part), tl.load(subcarrier + 2 * part + 1)
        k, dk = _TWO_PI * cycles.to(tl.float32), _TWO_PI * step.to(tl.float32)
        sine, cosine = sine_cosine_of_turns(_turns(length_m, cycles))
        size = tl.exp(-0.5 * spread * k * k)
        zr, zi = size * cosine, -size * sine
        sine, cosine = sine_cosine_of_turns(_turns(length_m, step))
        size = tl.exp(-0.5 * spread * dk * (2.0 * k + dk))
        wr, wi = size * cosine, -size * sine
        shrink = tl.exp(-spread * dk * dk)
        source = seed + part * SUBCARRIERS
        for index in tl.static_range(SUBCARRIERS):  # pyright: ignore[reportGeneralTypeIssues]
            u, v = tl.load(source + index), tl.load(source + width + index)
            at = k + dk * index
            p, q = zr * u - zi * v, zr * v + zi * u
            p0, p1, p2 = p0 + p, p1 + at * p, p2 + (at * at) * p
            q0, q1, q2 = q0 + q, q1 + at * q, q2 + (at * at) * q
            zr, zi = zr * wr - zi * wi, zr * wi + zi * wr
            wr, wi = wr * shrink, wi * shrink
    return p0, -q0, g * p0 - h * q0, g * q1 + h * p1, -0.5 * (g * p2 - h * q2)


@triton.jit
def _by_leg(scale, by_length, ux, uy, uz, inverse, vx, vy, vz):
    """What a Gaussian's place gets through one leg: of its length, and of its direction by `v`.

    dd/dp = -u and du/dp = -(I - u u^T)/d for each antenna.
    """
    near = scale * inverse - by_length
    ax, ay, az = _perpendicular(vx, vy, vz, ux, uy, uz)
    return near * ux - ax * inverse, near * uy - ay * inverse, near * uz - az * inverse


@triton.jit(do_not_specialize=["total", "links", "chunks", "rows_out", "per_split"])
def scatter_backward(
    means, shape, gain, visibility, normals, ends, group, subcarrier, seed, out,
    total, links, chunks, rows_out, per_split, sharpness,
    FACING: tl.constexpr, WEIGHED: tl.constexpr, SLOPES: tl.constexpr, SUBCARRIERS: tl.constexpr,
):  # fmt: skip
    """Writes out[split, rows_out, gaussian], given seed[link, re/im, chunk, SUBCARRIERS].

    The seed is conj(dL/dH), zero where a chunk has no subcarrier.
    """
    split, row = tl.program_id(1), tl.program_id(0) * SLOPES + tl.arange(0, SLOPES)
    mask = row < total
    px, py, pz = three_rows(means, row, mask, total, _FAR_M)
    g, h = tl.load(gain + row, mask, other=0.0), tl.load(gain + total + row, mask, other=0.0)
    none = tl.zeros([SLOPES], tl.float32)
    gx, gy, gz, gxx, gyy, gzz, gxy, gxz, gyz = (none,) * 9
    by_gain_r, by_gain_i, normal_x, normal_y, normal_z, nx, ny, nz = (none,) * 8
    if FACING:
        nx, ny, nz = three_rows(normals, row, mask, total, 0.0)
    base = out + (split * rows_out).to(tl.int64) * total
    for link in range(split * per_split, tl.minimum(links, (split + 1) * per_split)):
        d_t, tx, ty, tz, by_t = _leg(ends + 6 * link, px, py, pz)
        d_r, rx, ry, rz, by_r = _leg(ends + 6 * link + 3, px, py, pz)
        qx, qy, qz = tx + rx, ty + ry, tz + rz
        sx, sy, sz, spread = _spread(shape, row, mask, total, qx, qy, qz)
        seen, hide_t, hide_r = by_t * by_r, none, none
        if FACING:
            hide_t = tl.sigmoid(-sharpness * (nx * tx + ny * ty + nz * tz))
            hide_r = tl.sigmoid(-sharpness * (nx * rx + ny * ry + nz * rz))
            seen *= (1.0 - hide_t) * (1.0 - hide_r)
        weight = seen
        if WEIGHED:
            weight *= tl.load(visibility + tl.load(group + link) * total + row, mask, other=0.0)
        real, imaginary, by_weight, by_length, by_spread = _by_echo(
            d_t + d_r, spread, g, h, seed + 2 * link * chunks * SUBCARRIERS, chunks, subcarrier,
            SUBCARRIERS,
        )  # fmt: skip
        by_gain_r, by_gain_i = by_gain_r + weight * real, by_gain_i + weight * imaginary
        by_length, by_spread, scale = weight * by_length, weight * by_spread, weight * by_weight
        twice = 2.0 * by_spread
        gxx, gyy, gzz = plus(gxx, gyy, gzz, by_spread, qx * qx, qy * qy, qz * qz)
        gxy, gxz, gyz = plus(gxy, gxz, gyz, twice, qx * qy, qx * qz, qy * qz)
        vtx, vty, vtz = twice * sx, twice * sy, twice * sz
        vrx, vry, vrz = vtx, vty, vtz  # What the directions of both legs get.
        if FACING:
            facing_t, facing_r = sharpness * scale * hide_t, sharpness * scale * hide_r
            normal_x, normal_y, normal_z = plus(normal_x, normal_y, normal_z, facing_t, tx, ty, tz)
            normal_x, normal_y, normal_z = plus(normal_x, normal_y, normal_z, facing_r, rx, ry, rz)
            vtx, vty, vtz = plus(vtx, vty, vtz, facing_t, nx, ny, nz)
            vrx, vry, vrz = plus(vrx, vry, vrz, facing_r, nx, ny, nz)
        x1, y1, z1 = _by_leg(scale, by_length, tx, ty, tz, by_t, vtx, vty, vtz)
        x2, y2, z2 = _by_leg(scale, by_length, rx, ry, rz, by_r, vrx, vry, vrz)
        gx, gy, gz = gx + x1 + x2, gy + y1 + y2, gz + z1 + z2
        if WEIGHED:
            # Nobody else adds here; atomic, since a warp must see what another one has stored.
            own = (_GROUP + tl.load(group + link)) * total + row
            tl.atomic_add(base + own, by_weight * seen, mask)
    store_three(base, row, mask, total, gx, gy, gz)
    store_three(base + _SHAPE * total, row, mask, total, gxx, gyy, gzz)
    store_three(base + (_SHAPE + 3) * total, row, mask, total, gxy, gxz, gyz)
    tl.store(base + _GAIN * total + row, by_gain_r, mask)
    tl.store(base + (_GAIN + 1) * total + row, by_gain_i, mask)
    if FACING:
        store_three(base + _NORMALS * total, row, mask, total, normal_x, normal_y, normal_z)
