# SPDX-License-Identifier: Apache-2.0
"""Covariances of Gaussians from quaternions and scales."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

#: Row and column of the six distinct entries of a symmetric 3x3 matrix, in packed order.
PACKED_ROWS = (0, 1, 2, 0, 0, 1)
PACKED_COLS = (0, 1, 2, 1, 2, 2)


def rotations(quats: Float[Tensor, "gaussian 4"]) -> Float[Tensor, "gaussian 3 3"]:
    """Rotation matrices of quaternions, w first, of any length but zero."""
    w, x, y, z = torch.nn.functional.normalize(quats, dim=-1).unbind(-1)
    return torch.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        dim=-1,
    ).reshape(-1, 3, 3)


def covariances(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "gaussian 3 3"]:
    """Covariances R diag(s^2) R^T [m^2].

    Args:
        quats: Orientations, w first, need not be normalised.
        scales: Standard deviations along the three axes [m].
    """
    axes = rotations(quats) * scales[:, None, :]
    return axes @ axes.transpose(1, 2)


def packed_covariances(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "6 gaussian"]:
    """Distinct entries xx, yy, zz, xy, xz, yz of `covariances`, one row each.

    Written out per entry: torch takes four times as long for many products of 3x3 matrices.
    """
    w, x, y, z = torch.nn.functional.normalize(quats, dim=-1).T.contiguous().unbind(0)
    first, second, third = (scales.T.contiguous() ** 2).unbind(0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    weighted = [(a * first, b * second, c * third) for a, b, c in rows]
    entries = [
        sum(left * right for left, right in zip(weighted[a], rows[b], strict=True))
        for a, b in zip(PACKED_ROWS, PACKED_COLS, strict=True)
    ]
    return torch.stack([torch.as_tensor(entry) for entry in entries])
