# SPDX-License-Identifier: Apache-2.0
"""A program of its own that turns a MATLAB or HDF5 file into named arrays on its output.

Libraries that parse such files crash or ask for all memory on some damaged ones. Here that ends
this program alone: `rfgs_core.capture.table_file` starts it with limits and reads what it wrote.
It imports nothing of this package, so that it starts fast.

Usage: python table_child.py {mat|hdf5} FILE MEMORY_BYTES SECONDS
"""

from __future__ import annotations

import io
import sys
from typing import Any

import numpy as np

#: Arrays that one file may hold, and bytes of all of them.
MOST_ARRAYS = 4096


class Budget:
    """Arrays found so far, within a number of bytes."""

    def __init__(self, most_bytes: int) -> None:
        self.found: dict[str, np.ndarray] = {}
        self.left = most_bytes

    def keep(self, name: str, value: np.ndarray) -> None:
        """Keeps an array of numbers or text; anything else is left out."""
        if value.dtype.kind not in "biufcSU":
            return
        self.left -= value.nbytes
        if self.left < 0 or len(self.found) >= MOST_ARRAYS:
            raise MemoryError("more than the memory set aside for it")
        self.found[name] = value


def limit(memory_bytes: int, seconds: int) -> None:
    """Sets limits of this process, where the system has any."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def read_mat(path: str, budget: Budget) -> None:
    """MATLAB files up to version 7.2; a structure's fields are `name.field`.

    Of an array of structures, a field becomes one array with an axis for the structures; fields
    whose values differ in shape are left out, and empty ones among others are NaN.
    """
    from scipy.io import loadmat

    for name, value in loadmat(path, struct_as_record=True, squeeze_me=False).items():
        if not name.startswith("__"):
            _flatten(name, value, budget, 0)


def _flatten(name: str, value: Any, budget: Budget, depth: int) -> None:
    if not isinstance(value, np.ndarray) or depth > 4:
        return
    if value.dtype.names is None:
        budget.keep(name, value)
        return
    for field in value.dtype.names:
        parts = [np.asarray(part) for part in value[field].ravel()]
        if len(parts) == 1:
            _flatten(f"{name}.{field}", parts[0], budget, depth + 1)
            continue
        # MATLAB stores each number in the smallest type that holds it, and nothing where a
        # structure was never filled.
        shapes = {part.shape for part in parts if part.size}
        if len(shapes) == 1 and all(part.dtype.kind in "biufc" for part in parts):
            missing = np.full(shapes.pop(), np.nan)
            budget.keep(f"{name}.{field}", np.stack([p if p.size else missing for p in parts]))


def read_hdf5(path: str, budget: Budget) -> None:
    """HDF5 files; names are paths, text is UTF-8, compounds of real and imag become complex."""
    import h5py

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            _keep_hdf5(name, item, budget)

    with h5py.File(path, "r") as file:
        file.visititems(visit)


def _keep_hdf5(name: str, item: Any, budget: Budget) -> None:
    if item.size is None or item.size * max(item.dtype.itemsize, 1) > budget.left:
        raise MemoryError("more than the memory set aside for it")
    if item.dtype.kind == "O":
        if item.shape == () and isinstance(item[()], bytes):
            budget.keep(name, np.array(item[()].decode("utf-8", "replace")))
        return
    value = item[()]
    if item.dtype.names == ("real", "imag"):
        value = np.asarray(value)
        value = value["real"].astype(np.float32) + 1j * value["imag"].astype(np.float32)
        value = value.astype(np.complex64)
    budget.keep(name, np.asarray(value))


def main(arguments: list[str]) -> int:
    """Writes an `.npz` to standard output; 1 and a line on standard error if it cannot."""
    kind, path, memory_bytes, seconds = arguments
    budget = Budget(int(memory_bytes) // 4)
    # Libraries first: what they map counts as memory too.
    if kind == "hdf5":
        import h5py  # noqa: F401
    else:
        import scipy.io  # noqa: F401
    limit(int(memory_bytes), int(seconds))
    try:
        (read_hdf5 if kind == "hdf5" else read_mat)(path, budget)
        stream = io.BytesIO()
        np.savez(stream, **budget.found)  # type: ignore[arg-type]
    except Exception as error:  # Anything a damaged file provokes is the same answer.
        sys.stderr.write(f"{type(error).__name__}: {error}".splitlines()[0][:200])
        return 1
    sys.stdout.buffer.write(stream.getbuffer())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
