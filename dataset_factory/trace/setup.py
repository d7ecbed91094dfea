# SPDX-License-Identifier: Apache-2.0
"""Prepares a process for Sionna RT: LLVM, threads and the kernel cache.

Call `prepare` before anything imports drjit, mitsuba or sionna.
"""

from __future__ import annotations

import os

from rfgs_core.cache import cache_folder
from rfgs_core.llvm import use_llvm

#: Kernels differ from frame to frame, so an unlimited cache would fill the disk [bytes].
CACHE_LIMIT_BYTES = 1 << 30


def prepare(threads: int | None = None) -> None:
    """Sets the environment and the number of threads of Dr.Jit and numba.

    Args:
        threads: Threads per process; None leaves the choice to Dr.Jit and numba.

    Raises:
        MissingToolError: No usable LLVM library.
        RfgsError: The user's cache cannot be written.
    """
    use_llvm()
    if "DRJIT_CACHE_DIR" not in os.environ:
        os.environ["DRJIT_CACHE_DIR"] = str(cache_folder("drjit"))
    os.environ.setdefault("DRJIT_CACHE_MAXSIZE", str(CACHE_LIMIT_BYTES))
    if threads is None:
        return
    import drjit as dr
    import numba

    dr.set_thread_count(threads)
    numba.set_num_threads(min(threads, len(os.sched_getaffinity(0))))
