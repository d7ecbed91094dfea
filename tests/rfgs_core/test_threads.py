# SPDX-License-Identifier: Apache-2.0
"""Threads of compiled kernels sleep between their calls, and small matrices have one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

#: More threads than cores do not spin.
THREADS = min(4, len(os.sched_getaffinity(0)))
#: A program of fifty short kernels on all threads, 10 ms of sleep after each.
_KERNELS = Path(__file__).with_name("short_kernel.py")


def _processor_s(**env: str) -> float:
    kept = {name: value for name, value in os.environ.items() if name != "OMP_WAIT_POLICY"}
    env = {**kept, "NUMBA_NUM_THREADS": str(THREADS), "NUMBA_THREADING_LAYER": "omp", **env}
    done = subprocess.run(
        [sys.executable, str(_KERNELS)], env=env, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


@pytest.mark.slow
def test_threads_sleep_between_kernels_unless_told_otherwise() -> None:
    """Spinning threads take the half second of pauses on every core but one."""
    assert _processor_s() < 0.2
    if THREADS > 1:
        assert _processor_s(OMP_WAIT_POLICY="ACTIVE") > 0.2


def test_matrices_of_numpy_are_solved_on_one_thread_unless_told_otherwise() -> None:
    code = """
import os
import rfgs_core
import numpy as np

np.linalg.inv(np.random.default_rng(0).random((400, 400)))
print(len(os.listdir("/proc/self/task")))
"""
    kept = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    count = []
    for env in (kept, {**kept, "OPENBLAS_NUM_THREADS": str(THREADS)}):
        done = subprocess.run(
            [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
        )
        count.append(int(done.stdout))
    assert count == [1, THREADS]
