# SPDX-License-Identifier: Apache-2.0
"""Covariances of Gaussians from quaternions and scales."""

from __future__ import annotations

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


def packed_covariances(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "6 gaussian"]:
    """Distinct entries xx, yy, zz, xy, xz, yz of `covariances`, one row each.

    Written out per entry: torch takes four times as long for many products of 3x3 matrices.
    """
    quats = torch.nn.functional.normalize(quats, dim=-1)
    rows = rotation_rows(*quats.T.contiguous().unbind(0))
    first, second, third = (scales.T.contiguous() ** 2).unbind(0)
    weighted = [(a * first, b * second, c * third) for a, b, c in rows]
    entries = [
        sum(left * right for left, right in zip(weighted[a], rows[b], strict=True))
        for a, b in zip(PACKED_ROWS, PACKED_COLS, strict=True)
    ]
    return torch.stack([torch.as_tensor(entry) for entry in entries])
