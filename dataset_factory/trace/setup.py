# SPDX-License-Identifier: Apache-2.0
"""Prepares a process for Sionna RT: LLVM or CUDA, threads and the kernel cache.

Call `prepare` before anything imports drjit, mitsuba or sionna.
"""

from __future__ import annotations

import os
from importlib.metadata import version

from dataset_factory.plan.tracers import TracingDevice
from rfgs_core.cache import cache_folder
from rfgs_core.errors import MissingToolError
from rfgs_core.llvm import use_llvm

#: Kernels differ from frame to frame, so an unlimited cache would fill the disk [bytes].
CACHE_LIMIT_BYTES = 1 << 30


def prepare(threads: int | None = None, device: TracingDevice = "auto") -> None:
    """Sets the environment, what rays are traced on, and the threads of Dr.Jit and numba.

    Args:
        threads: Threads per process; None leaves the choice to Dr.Jit and numba.
        device: A GPU, the processor, or the former where there is one.

    Raises:
        MissingToolError: No usable LLVM library, or no GPU where one is asked for.
        RfgsError: The user's cache cannot be written.
    """
    use_llvm()
    if "DRJIT_CACHE_DIR" not in os.environ:
        os.environ["DRJIT_CACHE_DIR"] = str(cache_folder("drjit"))
    os.environ.setdefault("DRJIT_CACHE_MAXSIZE", str(CACHE_LIMIT_BYTES))
    _choose(device)
    if threads is None:
        return
    import drjit as dr
    import numba

    dr.set_thread_count(threads)
    numba.set_num_threads(min(threads, len(os.sched_getaffinity(0))))


def _choose(device: TracingDevice) -> None:
    """Sets Mitsuba's variant, which Sionna RT then takes; auto keeps one that is already set.

    Raises:
        MissingToolError: A GPU is asked for and Dr.Jit finds none.
    """
    import drjit as dr
    import mitsuba as mi

    if device == "auto" and mi.variant() is not None:
        return
    there = dr.has_backend(dr.JitBackend.CUDA)
    if device == "cuda" and not there:
        raise MissingToolError(
            f"--device cuda: Dr.Jit {version('drjit')} finds no GPU; expected an NVIDIA driver of "
            "version 535 or newer, or --device cpu"
        )
    chosen = "cuda" if there and device != "cpu" else "llvm"
    mi.set_variant(f"{chosen}_ad_mono_polarized")
