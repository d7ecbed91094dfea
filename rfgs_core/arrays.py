# SPDX-License-Identifier: Apache-2.0
"""Named arrays in .npz files, whole or absent, without pickle."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import replacing
from rfgs_core.links import refuse_link

#: Size of each axis: a number, or a name that stands for the same size throughout a file.
Shape = tuple[int | str, ...]

_DAMAGE = (
    *(OSError, ValueError, EOFError, MemoryError, NotImplementedError),
    *(zipfile.BadZipFile, zlib.error),
)


def save_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Writes arrays in one step; equal arrays give equal bytes."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def load_arrays(
    path: Path,
    remedy: str,
    shapes: Mapping[str, Shape | None] | None = None,
    unknown: Collection[str] = (),
    *,
    others: bool = True,
) -> dict[str, np.ndarray]:
    """Reads the arrays of a file.

    Args:
        path: The file.
        remedy: What to do about a missing or damaged file, for the message.
        shapes: Arrays that must be there. Those with a shape must have it and hold finite
            numbers; None leaves both open.
        unknown: Arrays in which a whole row may be NaN, for what is not known.
        others: Also read arrays that `shapes` does not name.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: The file is damaged, or lacks an array, or one is not as it should be.

    Example:
        `load_arrays(path, "train again", {"means": ("M", 3), "power": ("M",), "names": None})`
    """
    refuse_link(path)
    try:
        stored = np.load(path, allow_pickle=False)
        if isinstance(stored, np.ndarray):
            raise RfgsFormatError(f"{path}: expected named arrays, found a single one; {remedy}")
        with stored:
            wanted = [name for name in stored.files if others or name in (shapes or {})]
            arrays = {name: stored[name] for name in wanted}
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; {remedy}") from error
    except RfgsFormatError:
        raise
    except _DAMAGE as error:
        raise RfgsFormatError(f"{path}: damaged ({error}); {remedy}") from error
    known = {name: _without_unknown(arrays[name]) for name in unknown if name in arrays}
    problem = _misfit({**arrays, **known}, shapes or {})
    if problem:
        raise RfgsFormatError(f"{path}: {problem}; {remedy}")
    return arrays


def _without_unknown(values: np.ndarray) -> np.ndarray:
    """Values with zeros in the rows that are all NaN."""
    if values.dtype.kind != "f" or values.ndim < 1:
        return values
    unknown = np.isnan(values).all(axis=tuple(range(1, values.ndim)))
    return np.where(unknown.reshape(-1, *[1] * (values.ndim - 1)), values.dtype.type(0), values)


def _misfit(arrays: Mapping[str, np.ndarray], shapes: Mapping[str, Shape | None]) -> str:
    """What is wrong with the arrays, in words; empty if nothing is."""
    missing = [name for name in shapes if name not in arrays]
    if missing:
        return f"expected arrays {', '.join(shapes)}; missing {', '.join(missing)}"
    sizes: dict[str, int] = {}
    for name, shape in shapes.items():
        if shape is None:
            continue
        found = arrays[name]
        if len(found.shape) == len(shape):
            named = zip(shape, found.shape, strict=True)
            sizes = {axis: size for axis, size in named if isinstance(axis, str)} | sizes
        expected = tuple(sizes.get(axis, axis) if isinstance(axis, str) else axis for axis in shape)
        if found.shape != expected:
            return f"{name} has shape {found.shape}, expected {expected}"
        if found.dtype.kind not in "biufc" or not np.isfinite(found).all():
            return f"{name} holds something else than finite numbers"
    return ""
