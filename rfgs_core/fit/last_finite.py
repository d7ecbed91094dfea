# SPDX-License-Identifier: Apache-2.0
"""The last state of a descent whose loss was a number, and why the next one's was not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rfgs_core.arrays import save_arrays
from rfgs_core.errors import RfgsError
from rfgs_core.fit.parameters import TrainableGaussians

#: Steps between copies: one of 10⁶ Gaussians takes as long as a part of a step.
COPY_EVERY = 10


class LastFinite:
    """Remembers a good state every few steps; writes it down when the loss breaks."""

    def __init__(self, checkpoint: Path | None) -> None:
        self._checkpoint = checkpoint
        self._arrays: dict[str, np.ndarray] = {}
        self._left = 0

    def remember(self, arrays: Callable[[], dict[str, np.ndarray]]) -> None:
        """Copies the state that gave a finite loss, when its turn has come."""
        if self._checkpoint is None:
            return
        if self._left == 0:
            self._arrays = {name: value.copy() for name, value in arrays().items()}
            self._left = COPY_EVERY
        self._left -= 1

    def stop(self, step: int, loss: Tensor, target: Tensor, trained: TrainableGaussians) -> None:
        """Keeps the last good state and raises.

        Raises:
            RfgsError: Always; with the cause, and the file of the last good state.
        """
        kept = "; no step of this frame was good"
        if self._arrays and self._checkpoint is not None:
            save_arrays(self._checkpoint, self._arrays)
            kept = (
                f"; the state after {int(self._arrays['finished_steps'])} steps is kept in "
                f"{self._checkpoint}, delete it to start the frame over"
            )
        value, cause = float(loss.detach()), _cause(target, trained)
        raise RfgsError(f"the loss became {value} at step {step}; {cause}{kept}")


def _cause(target: Tensor, trained: TrainableGaussians) -> str:
    """What is not a number: the data, the Gaussians, or what they predict."""
    broken = int((~torch.isfinite(target)).any(dim=1).sum())
    if broken:
        return (
            f"the channel of {broken} links holds NaN or infinity, run `rfgs-factory validate` on "
            "the dataset"
        )
    for name, leaf in trained.leaves.items():
        rows = int((~torch.isfinite(leaf.detach())).reshape(len(leaf), -1).any(dim=1).sum())
        if rows:
            return (
                f"{name} of {rows} Gaussians are no numbers any more, lower the learning rates or "
                "--iterations"
            )
    return "finite Gaussians predict no finite channel, lower the learning rates"
