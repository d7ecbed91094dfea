# SPDX-License-Identifier: Apache-2.0
"""RF-GS core: datasets of radio channels, radio Gaussians, training and evaluation."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rfgs_core.dataset import open_dataset

__version__ = "0.1.0"
__all__ = ["__version__", "open_dataset"]

# Threads of compiled kernels spin after their work unless told to sleep, before OpenMP is loaded.
# Where a container shows more cores than it may use, every small operation of torch then waits
# for them: a training step took five times as long.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# OpenBLAS's threads always spin, and the matrices of numpy here are small: on one thread the
# evaluation is as fast, and ten times as fast where other programs want the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def __getattr__(name: str) -> Any:
    # Reading datasets pulls in xarray; `import rfgs_core` stays light.
    if name == "open_dataset":
        from rfgs_core.dataset import open_dataset

        return open_dataset
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
