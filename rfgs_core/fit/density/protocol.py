# SPDX-License-Identifier: Apache-2.0
"""What every density control answers to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from torch import Tensor

from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.parameters import TrainableGaussians


class DensityControl(Protocol):
    """Called after every optimisation step; edits rows through `TrainableGaussians.edit_rows`."""

    def after_step(
        self, step: int, trained: TrainableGaussians, points: SamplePoints | None
    ) -> None:
        """Watches, densifies and prunes when their turn comes.

        Args:
            step: Number of finished steps, from 1.
            trained: What to edit; its gradients are those of this step.
            points: The batch of sample points of this step, if the objective has one.
        """
        ...

    def state(self) -> dict[str, np.ndarray]:
        """What it remembers from step to step, for a checkpoint."""
        ...

    def resume(self, memory: Mapping[str, Tensor]) -> None:
        """Takes up what `state` returned, on the Gaussians' device; missing names start over."""
        ...


class NoDensity:
    """Gaussians neither come nor go."""

    def after_step(
        self, step: int, trained: TrainableGaussians, points: SamplePoints | None
    ) -> None:
        """Leaves everything as it is."""

    def state(self) -> dict[str, np.ndarray]:
        """Nothing."""
        return {}

    def resume(self, memory: Mapping[str, Tensor]) -> None:
        """Nothing."""
