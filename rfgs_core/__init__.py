# SPDX-License-Identifier: Apache-2.0
"""RF-GS core: datasets of radio channels, radio Gaussians, training and evaluation."""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rfgs_core.dataset import open_dataset
    from rfgs_core.dataset.torch_dataset import FrameDataset
    from rfgs_core.gaussians import Gaussians
    from rfgs_core.gaussians.ply import read_ply
    from rfgs_core.run import open_run
    from rfgs_core.run.training import train_sequence
    from rfgs_core.settings import TrainConfig

__version__ = "0.1.0"
__all__ = [
    "FrameDataset",
    "Gaussians",
    "TrainConfig",
    "__version__",
    "open_dataset",
    "open_run",
    "read_ply",
    "train_sequence",
]

#: Public name → where it is; docs/python.md shows each in use.
_MODULES = {
    "open_dataset": "rfgs_core.dataset",
    "FrameDataset": "rfgs_core.dataset.torch_dataset",
    "TrainConfig": "rfgs_core.settings",
    "train_sequence": "rfgs_core.run.training",
    "open_run": "rfgs_core.run",
    "Gaussians": "rfgs_core.gaussians",
    "read_ply": "rfgs_core.gaussians.ply",
}

# Threads of compiled kernels spin after their work unless told to sleep, before OpenMP is loaded.
# Where a container shows more cores than it may use, every small operation of torch then waits
# for them: a training step took five times as long.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# OpenBLAS's threads always spin, and the matrices of numpy here are small: on one thread the
# evaluation is as fast, and ten times as fast where other programs want the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def __getattr__(name: str) -> Any:
    # These pull in xarray or torch; `import rfgs_core` stays light.
    if name in _MODULES:
        return getattr(importlib.import_module(_MODULES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
