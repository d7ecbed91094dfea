# SPDX-License-Identifier: Apache-2.0
"""Covariances of Gaussians from quaternions and scales."""

from __future__ import annotations

import functools

import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.gaussians.model import rotation_matrices
from rfgs_core.rotations import rotation_rows

#: Row and column of the six distinct entries of a symmetric 3x3 matrix, in packed order.
PACKED_ROWS = (0, 1, 2, 0, 0, 1)
PACKED_COLS = (0, 1, 2, 1, 2, 2)


def covariances(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "gaussian 3 3"]:
    """Covariances R diag(s^2) R^T [m^2].

    Args:
        quats: Orientations, w first, need not be normalised.
        scales: Standard deviations along the three axes [m].
    """
    axes = rotation_matrices(quats) * scales[:, None, :]
    return axes @ axes.transpose(1, 2)


def covariances_by_products(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "6 gaussian"]:
    """Their entries xx, yy, zz, xy, xz, yz in a few large steps: small ones make a GPU wait.

    A rotation is linear in the products of its unit quaternion's entries.
    """
    unit = torch.nn.functional.normalize(quats, dim=1)
    pairs = (unit[:, :, None] * unit[:, None, :]).reshape(-1, 16)
    turn, pick = _constants(quats.device, quats.dtype)
    axes = (pairs @ turn).reshape(-1, 3, 3) * scales[:, None, :]
    # Not `@`: a library's product of a hundred thousand 3 x 3 matrices takes forty times as long.
    square = (axes[:, :, None, :] * axes[:, None, :, :]).sum(dim=-1)
    return (square.reshape(-1, 9) @ pick).T


@functools.lru_cache(maxsize=8)
def _constants(device: torch.device, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """From products of quaternion entries to a rotation [16, 9], and from that to six [9, 6]."""
    basis = torch.eye(4, dtype=torch.float64)
    # Of both orders of a product half; a rotation of a sum less those of its parts is twice it.
    turn = torch.zeros(4, 4, 9, dtype=torch.float64)
    for a in range(4):
        for b in range(4):
            turn[a, b] = 0.5 * (
                _square(basis[a] + basis[b]) - _square(basis[a]) - _square(basis[b])
            )
    pick = torch.zeros(9, 6, dtype=torch.float64)
    pick[[3 * a + b for a, b in zip(PACKED_ROWS, PACKED_COLS, strict=True)], range(6)] = 1.0
    return turn.reshape(16, 9).to(device, dtype), pick.to(device, dtype)


def _square(quat: Float[Tensor, "4"]) -> Float[Tensor, "9"]:
    """|q|² times the rotation of q: 1 − 2 (y² + z²) is w² + x² − y² − z² of a unit one."""
    size = float(quat @ quat)
    rows = rotation_rows(*(quat / size**0.5).tolist())
    return size * torch.tensor(rows, dtype=torch.float64).reshape(9)
