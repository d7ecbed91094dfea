# SPDX-License-Identifier: Apache-2.0
"""Radio Gaussians of a few points, and a run on the tiny dataset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from rfgs_core.dataset import open_dataset
from rfgs_core.propagation import RadioGaussians
from rfgs_core.run import Run
from rfgs_core.run.training import train_sequence
from rfgs_core.train.config import TrainConfig


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


@pytest.fixture(scope="session")
def small_run(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of 40 Gaussians on both frames; copy it before changing anything."""
    data = open_dataset(tiny_dataset)
    config = TrainConfig(num_gaussians=40, power_steps=0, solver_steps=2, iterations=1)
    out = tmp_path_factory.mktemp("predicted") / "run"
    return train_sequence(data, data.sequence(), "wifi", [1, 2], config, out)
