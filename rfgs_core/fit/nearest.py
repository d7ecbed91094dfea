# SPDX-License-Identifier: Apache-2.0
"""Which Gaussian is closest to a point, and how far it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int64
from scipy.spatial import KDTree
from torch import Tensor

#: Programs that keep a large GPU busy, and the fewest Gaussians that one looks at.
_PROGRAMS, _LEAST = 2048, 2048


def nearest_gaussian(
    points: Float[Tensor, "N 3"], means: Float[Tensor, "M 3"]
) -> tuple[Int64[Tensor, "N"], Float[Tensor, "N"]]:
    """Index of and distance [m] to the Gaussian closest to each point; at least one is there."""
    means = means.detach()
    if means.device.type != "cpu":
        return nearest_on_gpu(points, means)
    # Of a tree that few points ask, most of the time is its making: half as long unbalanced.
    much = len(points) >= len(means)
    tree = KDTree(means.numpy(), compact_nodes=much, balanced_tree=much)
    distance, index = tree.query(points.numpy())
    return torch.from_numpy(np.asarray(index)), torch.from_numpy(np.asarray(distance)).float()


def nearest_on_gpu(
    points: Float[Tensor, "N 3"], means: Float[Tensor, "M 3"]
) -> tuple[Int64[Tensor, "N"], Float[Tensor, "N"]]:
    """Twin of `nearest_gaussian` on the device of `means`, in single precision."""
    from rfgs_core.fit.kernels_triton import COLUMNS, POINTS, nearest_of

    count, total = len(points), len(means)
    blocks = -(-count // POINTS)
    splits = max(1, min(-(-_PROGRAMS // max(blocks, 1)), total // _LEAST))
    per_split = -(-total // splits // COLUMNS) * COLUMNS
    square = means.new_full((splits, count), torch.inf, dtype=torch.float32)
    index = torch.zeros_like(square, dtype=torch.int32)
    if count:
        columns = [x.float().T.contiguous() for x in (points, means)]
        kernel: Any = nearest_of
        kernel[(blocks, splits)](
            *columns, square, index, count, total, per_split, POINTS=POINTS, COLUMNS=COLUMNS
        )
    least, split = square.min(dim=0)
    return index.gather(0, split[None])[0].long(), least.sqrt()
