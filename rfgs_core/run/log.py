# SPDX-License-Identifier: Apache-2.0
"""Curves of a training run for TensorBoard."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from rfgs_core.links import refuse_link

#: Takes the number of finished steps of a frame and values by name.
Scalars = Callable[[int, Mapping[str, float]], None]


class TrainingLog:
    """Scalars per frame and step; writes nothing where no folder is given.

    Event files hold the time of day, so they are no part of what repeats byte for byte.
    """

    def __init__(self, folder: Path | None) -> None:
        self._writer = None
        if folder is not None:
            refuse_link(folder)
            from torch.utils.tensorboard import SummaryWriter

            self._writer = SummaryWriter(str(folder))

    def of_frame(self, frame: int) -> Scalars | None:
        """Where the steps of a frame are reported to."""
        writer = self._writer
        if writer is None:
            return None

        def report(step: int, values: Mapping[str, float]) -> None:
            for name, value in values.items():
                writer.add_scalar(f"frame {frame:06d}/{name}", value, step)

        return report

    def __enter__(self) -> TrainingLog:
        return self

    def __exit__(self, *_error: object) -> None:
        if self._writer is not None:
            self._writer.close()
