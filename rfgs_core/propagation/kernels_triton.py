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

#: Gaussians and subcarriers of one tile: sixteen terms per thread of four warps.
ROWS, SUBCARRIERS = 64, 32
#: Rows of the gradient: positions, covariances, real and imaginary gain, normals; then groups.
BY_MEANS, BY_SHAPE, BY_GAIN, BY_NORMALS, BY_GROUP = 0, 3, 9, 11, 14

_SHAPE, _GAIN, _NORMALS = tl.constexpr(BY_SHAPE), tl.constexpr(BY_GAIN), tl.constexpr(BY_NORMALS)
_GROUP = tl.constexpr(BY_GROUP)
_TWO_PI = tl.constexpr(6.283185307179586)
#: Where rows behind the last Gaussian stand [m]: nowhere near an antenna.
_FAR_M = tl.constexpr(1e3)


@triton.jit
def _leg(end, px, py, pz):
    """Length (double), unit vector and inverse length (single) from Gaussians to an antenna."""
    x, y, z = tl.load(end) - px, tl.load(end + 1) - py, tl.load(end + 2) - pz
    length = tl.sqrt(x * x + y * y + z * z)
    inverse = 1.0 / length.to(tl.float32)
    return (
        length,
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
def _echo(length_m, spread, subcarrier, SUBCARRIERS: tl.constexpr):
    """Re z, Im z [row, subcarrier] and wavenumbers of a chunk, z = exp(-k^2 Q / 2 - jkd)."""
    cycles, step = tl.load(subcarrier), tl.load(subcarrier + 1)
    turns, turn = length_m * cycles, length_m * step
    turns = (turns - tl.floor(turns + 0.5)).to(tl.float32)
    turn = (turn - tl.floor(turn + 0.5)).to(tl.float32)
    offset = tl.arange(0, SUBCARRIERS).to(tl.float32)
    k = _TWO_PI * (cycles.to(tl.float32) + step.to(tl.float32) * offset)
    turns = turns[:, None] + turn[:, None] * offset[None, :]
    sine, cosine = sine_cosine_of_turns(turns - tl.floor(turns + 0.5))
    size = tl.exp(-0.5 * spread[:, None] * (k * k)[None, :])
    return size * cosine, -size * sine, k


# One binary whatever the counts: density control changes them all the time.
@triton.jit(do_not_specialize=["total", "columns", "per_split"])
def scatter_forward(
    means,
    shape,
    gain,
    visibility,
    normals,
    ends,
    group,
    chunk,
    subcarrier,
    out,
    total,
    columns,
    per_split,
    sharpness,
    FACING: tl.constexpr,
    WEIGHED: tl.constexpr,
    ROWS: tl.constexpr,
    SUBCARRIERS: tl.constexpr,
):
    """Writes out[split, link, re/im, column]: sums over a split of the Gaussians, one chunk."""
    link, part, split = tl.program_id(0), tl.program_id(1), tl.program_id(2)
    offset = tl.arange(0, SUBCARRIERS)
    real, imaginary = tl.zeros([SUBCARRIERS], tl.float32), tl.zeros([SUBCARRIERS], tl.float32)
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
        zr, zi, _ = _echo(d_t + d_r, spread, subcarrier + 2 * part, SUBCARRIERS)
        real += tl.sum(g[:, None] * zr - h[:, None] * zi, axis=0)
        imaginary += tl.sum(g[:, None] * zi + h[:, None] * zr, axis=0)
    column, count = tl.load(chunk + 2 * part), tl.load(chunk + 2 * part + 1)
    target = out + ((split * tl.num_programs(0) + link) * 2).to(tl.int64) * columns + column
    tl.store(target + offset, real, offset < count)
    tl.store(target + columns + offset, imaginary, offset < count)


@triton.jit
def _perpendicular(x, y, z, ux, uy, uz):
    """Part of a vector that is perpendicular to the unit vector u."""
    along = x * ux + y * uy + z * uz
    return x - along * ux, y - along * uy, z - along * uz


@triton.jit
def _by_echo(
    length_m, spread, g, h, seed, chunk, chunks, columns, subcarrier,
    ROWS: tl.constexpr, SUBCARRIERS: tl.constexpr,
):  # fmt: skip
    """Sums over a link's subcarriers for the gain (re, im), the weight, the length and the spread.

    All but that of the weight are for a weight of 1.
    """
    offset = tl.arange(0, SUBCARRIERS)
    none = tl.zeros([ROWS], tl.float32)
    real, imaginary, by_weight, by_length, by_spread = none, none, none, none, none
    for part in range(chunks):
        zr, zi, k = _echo(length_m, spread, subcarrier + 2 * part, SUBCARRIERS)
        source = seed + tl.load(chunk + 2 * part)
        inside = offset < tl.load(chunk + 2 * part + 1)
        u = tl.load(source + offset, inside, other=0.0)[None, :]
        v = tl.load(source + columns + offset, inside, other=0.0)[None, :]
        p, q = zr * u - zi * v, zr * v + zi * u
        real += tl.sum(p, axis=1)
        imaginary -= tl.sum(q, axis=1)
        s, t = g[:, None] * p - h[:, None] * q, g[:, None] * q + h[:, None] * p
        by_weight += tl.sum(s, axis=1)
        by_length += tl.sum(k[None, :] * t, axis=1)
        by_spread -= tl.sum((0.5 * k * k)[None, :] * s, axis=1)
    return real, imaginary, by_weight, by_length, by_spread


@triton.jit
def _by_leg(scale, by_length, ux, uy, uz, inverse, vx, vy, vz):
    """What a Gaussian's place gets through one leg: of its length, and of its direction by `v`.

    dd/dp = -u and du/dp = -(I - u u^T)/d for each antenna.
    """
    near = scale * inverse - by_length
    ax, ay, az = _perpendicular(vx, vy, vz, ux, uy, uz)
    return near * ux - ax * inverse, near * uy - ay * inverse, near * uz - az * inverse


@triton.jit(do_not_specialize=["total", "links", "chunks", "columns", "rows_out", "per_split"])
def scatter_backward(
    means, shape, gain, visibility, normals, ends, group, chunk, subcarrier, seed, out,
    total, links, chunks, columns, rows_out, per_split, sharpness,
    FACING: tl.constexpr, WEIGHED: tl.constexpr, ROWS: tl.constexpr, SUBCARRIERS: tl.constexpr,
):  # fmt: skip
    """Writes out[split, rows_out, gaussian], given seed[link, re/im, column] = conj(dL/dH)."""
    split, row = tl.program_id(1), tl.program_id(0) * ROWS + tl.arange(0, ROWS)
    mask = row < total
    px, py, pz = three_rows(means, row, mask, total, _FAR_M)
    g, h = tl.load(gain + row, mask, other=0.0), tl.load(gain + total + row, mask, other=0.0)
    none = tl.zeros([ROWS], tl.float32)
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
            d_t + d_r, spread, g, h, seed + 2 * link * columns, chunk, chunks, columns, subcarrier,
            ROWS, SUBCARRIERS,
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
