# SPDX-License-Identifier: Apache-2.0
"""Covariances of Gaussians on the CPU and their gradients, derived by hand.

With the rotation R of the unit quaternion u = q / |q|, S = R diag(s^2) R^T. Given M = dL/dS,
symmetric,

    dL/ds_k = 2 s_k r_k^T M r_k,    dL/dR = 2 M R diag(s^2),    dL/dq = (I - u u^T) dL/du / |q|.

As steps of torch they take a fifth of the time that the whole model takes with its gradients.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange

from rfgs_core.propagation.kernels_scatter import OPTIONS
from rfgs_core.vector_math import BLOCK, four_rows, six_rows, three_rows

#: A quaternion shorter than this is taken as this long, as `torch.nn.functional.normalize` does.
_SHORTEST = 1e-12


@njit(inline="always", **OPTIONS)
def _times(m: Any, vector: Any) -> Any:
    """A symmetric matrix, given by its six entries, times a vector."""
    (xx, yy, zz, xy, xz, yz), (x, y, z) = m, vector
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@njit(inline="always", **OPTIONS)
def _axes(w: float, x: float, y: float, z: float, one: float) -> Any:
    """Columns of the rotation of a unit quaternion: see `rotation_rows`."""
    two = one + one
    first = one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)
    second = two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)
    third = two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)
    return first, second, third


@njit(forceinline=True, **OPTIONS)
def _entries(quats: np.ndarray, scales: np.ndarray, first: int, n: int, out: np.ndarray) -> None:
    """One block of `covariance_forward`."""
    real = quats.dtype.type
    qw, qx, qy, qz = four_rows(quats, first, n)
    s1, s2, s3 = three_rows(scales, first, n)
    xx, yy, zz, xy, xz, yz = six_rows(out, first, n)
    shortest, one = real(_SHORTEST), real(1.0)
    for b in range(n):
        w, x, y, z = qw[b], qx[b], qy[b], qz[b]
        inverse = one / max(math.sqrt(w * w + x * x + y * y + z * z), shortest)
        p, q, r = _axes(w * inverse, x * inverse, y * inverse, z * inverse, one)
        u, v, t = s1[b] * s1[b], s2[b] * s2[b], s3[b] * s3[b]
        xx[b] = p[0] * p[0] * u + q[0] * q[0] * v + r[0] * r[0] * t
        yy[b] = p[1] * p[1] * u + q[1] * q[1] * v + r[1] * r[1] * t
        zz[b] = p[2] * p[2] * u + q[2] * q[2] * v + r[2] * r[2] * t
        xy[b] = p[0] * p[1] * u + q[0] * q[1] * v + r[0] * r[1] * t
        xz[b] = p[0] * p[2] * u + q[0] * q[2] * v + r[0] * r[2] * t
        yz[b] = p[1] * p[2] * u + q[1] * q[2] * v + r[1] * r[2] * t


@njit(forceinline=True, **OPTIONS)
def _chain(
    quats: np.ndarray,
    scales: np.ndarray,
    seed: np.ndarray,
    first: int,
    n: int,
    by_quats: np.ndarray,
    by_scales: np.ndarray,
) -> None:
    """One block of `covariance_backward`."""
    real = quats.dtype.type
    qw, qx, qy, qz = four_rows(quats, first, n)
    s1, s2, s3 = three_rows(scales, first, n)
    xx, yy, zz, xy, xz, yz = six_rows(seed, first, n)
    gw, gx, gy, gz = four_rows(by_quats, first, n)
    g1, g2, g3 = three_rows(by_scales, first, n)
    shortest, one, half = real(_SHORTEST), real(1.0), real(0.5)
    for b in range(n):
        w, x, y, z = qw[b], qx[b], qy[b], qz[b]
        inverse = one / max(math.sqrt(w * w + x * x + y * y + z * z), shortest)
        w, x, y, z = w * inverse, x * inverse, y * inverse, z * inverse
        p, q, r = _axes(w, x, y, z, one)
        # An entry beside the diagonal stands for both of the matrix.
        m = xx[b], yy[b], zz[b], half * xy[b], half * xz[b], half * yz[b]
        mp, mq, mr = _times(m, p), _times(m, q), _times(m, r)
        u, v, t = s1[b] + s1[b], s2[b] + s2[b], s3[b] + s3[b]
        g1[b] = u * (p[0] * mp[0] + p[1] * mp[1] + p[2] * mp[2])
        g2[b] = v * (q[0] * mq[0] + q[1] * mq[1] + q[2] * mq[2])
        g3[b] = t * (r[0] * mr[0] + r[1] * mr[1] + r[2] * mr[2])
        # Twice dL/dR, column by column: every entry of R has a factor 2 or is 1 - 2 (...).
        u, v, t = u * s1[b], v * s2[b], t * s3[b]
        u, v, t = u + u, v + v, t + t
        ax, ay, az = u * mp[0], u * mp[1], u * mp[2]
        bx, by, bz = v * mq[0], v * mq[1], v * mq[2]
        cx, cy, cz = t * mr[0], t * mr[1], t * mr[2]
        dw = z * (ay - bx) + y * (cx - az) + x * (bz - cy)
        dx = y * (ay + bx) + z * (az + cx) + w * (bz - cy) - (x + x) * (by + cz)
        dy = x * (ay + bx) + z * (bz + cy) + w * (cx - az) - (y + y) * (ax + cz)
        dz = x * (az + cx) + y * (bz + cy) + w * (ay - bx) - (z + z) * (ax + by)
        along = w * dw + x * dx + y * dy + z * dz
        gw[b], gx[b] = (dw - along * w) * inverse, (dx - along * x) * inverse
        gy[b], gz[b] = (dy - along * y) * inverse, (dz - along * z) * inverse


@njit(parallel=True, **OPTIONS)
def covariance_forward(quats: np.ndarray, scales: np.ndarray, out: np.ndarray) -> None:
    """Writes xx, yy, zz, xy, xz, yz [6, gaussian].

    Args:
        quats: Orientations, w first, of any length, real [4, gaussian].
        scales: Standard deviations along the three axes [m], real [3, gaussian].
        out: Covariances [m^2].
    """
    total = quats.shape[1]
    for block in prange((total + BLOCK - 1) // BLOCK):
        first = block * BLOCK
        _entries(quats, scales, first, min(BLOCK, total - first), out)


@njit(parallel=True, **OPTIONS)
def covariance_backward(
    quats: np.ndarray,
    scales: np.ndarray,
    seed: np.ndarray,
    by_quats: np.ndarray,
    by_scales: np.ndarray,
) -> None:
    """Writes gradients in the layout of `quats` and `scales`, given dL/d of the six entries."""
    total = quats.shape[1]
    for block in prange((total + BLOCK - 1) // BLOCK):
        first = block * BLOCK
        _chain(quats, scales, seed, first, min(BLOCK, total - first), by_quats, by_scales)
