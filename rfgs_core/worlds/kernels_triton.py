# SPDX-License-Identifier: Apache-2.0
"""What each facet sends along each way, on a GPU: the two factors of a product of matrices.

The formulas are those of `echoes._add_echo`; the plain twin is `batched_echoes.BatchedEchoes._sum`
on the CPU, whose tensors of 49 ranges and 35 beams per facet here never leave the registers but
for the factors themselves.
"""

from __future__ import annotations

import triton
import triton.language as tl

from rfgs_core.propagation.triton_math import sine_cosine_of_turns
from rfgs_core.worlds.echoes import (
    ASLANT,
    FORWARD,
    LOBES_OF_GAP,
    MOST_DAMPED,
    PER_CELL,
    PER_COSINE,
    TABLE,
    WIDEST,
)

#: Facets of a program, numbers of a way (ends, cosines, first range, gain) and its rows (moment,
#: four tables, response).
BLOCK, NUMBERS, ROWS = 128, 24, 6

_NUMBERS, _ROWS = tl.constexpr(NUMBERS), tl.constexpr(ROWS)
_ASLANT, _RISE = tl.constexpr(ASLANT), tl.constexpr(1.0 / (FORWARD - ASLANT))
_MOST_DAMPED = tl.constexpr(MOST_DAMPED)
_PER_COSINE, _WIDEST = tl.constexpr(float(PER_COSINE)), tl.constexpr(WIDEST)
_LAST = tl.constexpr(TABLE - 1.001)
_MIDDLE = tl.constexpr(float(LOBES_OF_GAP * PER_CELL))
#: Beams up and across, and their distance as a direction cosine, of `body_maps`.
UP, ACROSS = 7, 5
_UP, _ACROSS, _BEAM = tl.constexpr(UP), tl.constexpr(ACROSS), tl.constexpr(0.15)
_PER_SPHERE = tl.constexpr(0.07957747154594767)


@triton.jit
def _three(at):
    return tl.load(at), tl.load(at + 1), tl.load(at + 2)


@triton.jit
def _dot(ax, ay, az, bx, by, bz):
    return ax * bx + ay * by + az * bz


@triton.jit
def _leg(end, px, py, pz):
    """Length and unit vector from an end to points."""
    ex, ey, ez = _three(end)
    x, y, z = px - ex, py - ey, pz - ez
    length = tl.sqrt(x * x + y * y + z * z)
    return length, x / length, y / length, z / length


@triton.jit
def _off(end, cosines, ux, uy, uz):
    """Direction cosines along an end's two axes, less those of the centre."""
    yx, yy, yz = _three(end + 3)
    zx, zy, zz = _three(end + 6)
    across = _dot(yx, yy, yz, ux, uy, uz) - tl.load(cosines)
    return across, _dot(zx, zy, zz, ux, uy, uz) - tl.load(cosines + 1)


@triton.jit
def _read(table, off, mask):
    """A table of direction cosines."""
    at = tl.minimum(tl.maximum((off + _WIDEST) * _PER_COSINE, 0.0), _LAST)
    low = at.to(tl.int32)
    lower = tl.load(table + low, mask, other=0.0)
    return lower + (at - low) * (tl.load(table + low + 1, mask, other=0.0) - lower)


@triton.jit
def _sent(lit, area, damping, screen, c_i, c_s, forward):
    """What facets send on, over A/(4 pi d_t d_r): an echo, a shadow or both."""
    q_n = c_i + c_s
    damped = damping * area * tl.maximum(2.0 - 2.0 * forward - q_n * q_n, 0.0)
    echo = tl.where((lit >= 2) & (c_s > 0.0), 0.5 * q_n, 0.0)
    dark = tl.minimum(tl.maximum((forward - _ASLANT) * _RISE, 0.0), 1.0) * screen * c_i
    counts = ((lit == 1) | (lit == 3)) & (c_i > 0.0) & (damped <= _MOST_DAMPED)
    return tl.where(counts, (echo + dark) * tl.exp(-damped), 0.0)


@triton.jit(do_not_specialize=["facets", "ranges", "last"])
def facet_waves(
    points, normals, areas, lit, numbers, rows, tables, responses, beams, waves,
    facets, ranges, last, per_wave, damping, screen, per_step, per_range,
    BLOCK: tl.constexpr,
):  # fmt: skip
    """Writes beams[way, 35, facet] and waves[way, re/im, range, facet].

    `lit` is 1 where the transmitter sees a facet, plus 2 where the receiver does. `last` is the
    last sample of a response, `per_wave` 1 / wavelength, `damping` k^2 / 24, `screen` what a shadow
    weighs against an echo, `per_step` 1 over the distance of ranges and `per_range` samples of the
    response from range to range.
    """
    way, f = tl.program_id(1).to(tl.int64), tl.program_id(0) * BLOCK + tl.arange(0, BLOCK)
    mask = f < facets
    own, row = numbers + way * _NUMBERS, rows + way * _ROWS
    at = (tl.load(row) * facets + f) * 3
    px = tl.load(points + at, mask, other=0.0)
    py = tl.load(points + at + 1, mask, other=0.0)
    pz = tl.load(points + at + 2, mask, other=0.0)
    nx = tl.load(normals + at, mask, other=0.0)
    ny = tl.load(normals + at + 1, mask, other=0.0)
    nz = tl.load(normals + at + 2, mask, other=0.0)
    area = tl.load(areas + f, mask, other=0.0)
    seen = tl.load(lit + way * facets + f, mask, other=0)
    d_t, tx, ty, tz = _leg(own, px, py, pz)
    d_r, rx, ry, rz = _leg(own + 9, px, py, pz)
    c_i, c_s = -_dot(tx, ty, tz, nx, ny, nz), -_dot(rx, ry, rz, nx, ny, nz)
    forward = -_dot(tx, ty, tz, rx, ry, rz)
    size = _sent(seen, area, damping, screen, c_i, c_s, forward)
    size = size * area * _PER_SPHERE * tl.load(own + 23) / (d_t * d_r)
    turns = (d_t + d_r) * per_wave
    sine, cosine = sine_cosine_of_turns(turns - tl.floor(turns + 0.5))
    real, imaginary = size * cosine, -size * sine
    place = (d_t + d_r - tl.load(own + 22)) * per_step
    response = responses + 2 * tl.load(row + 5)
    out = waves + way * 2 * ranges * facets + f
    for m in range(ranges):
        x = (m - place) * per_range + _MIDDLE
        near = mask & (x >= 0.0) & (x <= last)
        x = tl.minimum(tl.maximum(x, 0.0), last - 1e-3)
        low = x.to(tl.int32)
        share = x - low
        a = tl.load(response + 2 * low, near, other=0.0)
        b = tl.load(response + 2 * low + 1, near, other=0.0)
        a += share * (tl.load(response + 2 * low + 2, near, other=0.0) - a)
        b += share * (tl.load(response + 2 * low + 3, near, other=0.0) - b)
        tl.store(out + m * facets, a * real - b * imaginary, mask)
        tl.store(out + (ranges + m) * facets, a * imaginary + b * real, mask)
    t_y, t_z = _off(own, own + 18, tx, ty, tz)
    r_y, r_z = _off(own + 9, own + 20, rx, ry, rz)
    out = beams + way * _UP * _ACROSS * facets + f
    for e in range(_UP):
        turned = (e - (_UP - 1) // 2) * _BEAM
        up = _read(tables + tl.load(row + 2), t_z - turned, mask)
        up *= _read(tables + tl.load(row + 4), r_z - turned, mask)
        for a in range(_ACROSS):
            turned = (a - (_ACROSS - 1) // 2) * _BEAM
            across = _read(tables + tl.load(row + 1), t_y - turned, mask)
            across *= _read(tables + tl.load(row + 3), r_y - turned, mask)
            tl.store(out + (e * _ACROSS + a) * facets, up * across, mask)
