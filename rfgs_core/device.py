# SPDX-License-Identifier: Apache-2.0
"""The device that a fit computes on: whether it is there, and whether it is done."""

from __future__ import annotations

import dataclasses
import importlib.util
import os
import shutil
import sys
from typing import Any, Literal, TypeVar, cast

from rfgs_core.errors import MissingToolError

#: cuda: the current GPU.
Device = Literal["cpu", "cuda"]

_Value = TypeVar("_Value")


def need_device(device: Device) -> None:
    """Refuses a GPU that is not there.

    Raises:
        MissingToolError: torch finds no GPU, or the compiler of its kernels is missing.
    """
    if device == "cpu":
        return
    import torch

    if not torch.cuda.is_available():
        raise MissingToolError(
            f"--device cuda: torch {torch.__version__} finds no GPU; expected an NVIDIA driver and "
            "a torch built for CUDA, or --device cpu; `rfgs info` shows what is there"
        )
    if importlib.util.find_spec("triton") is None:
        raise MissingToolError("--device cuda compiles its kernels with triton: pip install triton")
    if not any(shutil.which(name) for name in (os.environ.get("CC", "gcc"), "gcc", "clang")):
        raise MissingToolError(
            "--device cuda needs a C compiler and Python's headers, with which triton builds its "
            "launcher: apt-get install gcc python3.11-dev, or name a compiler in CC"
        )


def on_device(value: _Value, device: Any) -> _Value:
    """A tensor, or a dataclass with all tensors in it, on a device; anything else as it is."""
    import torch

    if isinstance(value, torch.Tensor):
        return cast(_Value, value.to(device))
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        return value
    moved = {f.name: on_device(getattr(value, f.name), device) for f in dataclasses.fields(value)}
    return dataclasses.replace(value, **moved)


def finish_device() -> None:
    """Waits for what a GPU has been asked to do, so that it can be timed."""
    import torch

    if torch.cuda.is_available():
        torch.cuda.synchronize()


def most_held_gib(device: Device) -> float:
    """The most memory that this process has held there [GiB]."""
    if device == "cuda":
        import torch

        return torch.cuda.max_memory_allocated() / 2**30
    import resource  # No system but Unix has it.

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30
