# SPDX-License-Identifier: Apache-2.0
"""Radio Gaussians of a few points."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch

from rfgs_core.propagation import RadioGaussians


@pytest.fixture
def make_points() -> Callable[..., RadioGaussians]:
    """Gaussians of a millimetre, seen from all sides; one column of γ per knot."""

    def make(means: list, gamma: list, alpha: float = 0.0, scale_m: float = 1e-3) -> RadioGaussians:
        count = len(means)
        return RadioGaussians(
            means=torch.tensor(means, dtype=torch.float64),
            quats=torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(count, 1),
            scales=torch.full((count, 3), scale_m),
            scales_rf=torch.full((count, 3), 1e-4),
            gamma=torch.tensor(gamma, dtype=torch.complex64).reshape(count, -1),
            alpha=torch.full((count,), alpha),
        )

    return make
