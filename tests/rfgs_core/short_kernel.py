# SPDX-License-Identifier: Apache-2.0
"""Prints the processor time of fifty short kernels on all threads, 10 ms of sleep after each."""

from __future__ import annotations

import sys
import time

import rfgs_core  # noqa: F401  before torch, as programs do: it tells OpenMP how threads wait

# isort: split
import numba
import numpy as np
import torch  # noqa: F401  with threads of its own


@numba.njit(parallel=True, cache=True)
def add_one(values: np.ndarray) -> None:
    """Adds one to each value."""
    for i in numba.prange(len(values)):
        values[i] += 1


def main() -> None:
    """Compiles or loads the kernel before the clock starts."""
    values = np.zeros(1000)
    add_one(values)
    start = time.process_time()
    for _ in range(50):
        add_one(values)
        time.sleep(0.01)
    sys.stdout.write(f"{time.process_time() - start}\n")


if __name__ == "__main__":
    main()
