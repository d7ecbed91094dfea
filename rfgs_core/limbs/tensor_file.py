# SPDX-License-Identifier: Apache-2.0
"""Named tensors in safetensors files, which may come from anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from rfgs_core.errors import RfgsFormatError
from rfgs_core.links import refuse_link
from rfgs_core.seals import check_seal

#: Largest file that is read; networks have 2 MB, what a training keeps has 14 MB.
_MOST_BYTES = 64 * 2**20


def read_tensors(path: Path, remedy: str) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors of a file by name, and the texts beside them.

    Args:
        path: The file, which exists.
        remedy: What to do about a damaged file, for the message.

    Raises:
        RfgsFormatError: It is damaged, changed since it was sealed, too large, or holds NaN or
            infinity.
    """
    refuse_link(path)
    if path.stat().st_size > _MOST_BYTES:
        raise RfgsFormatError(f"{path}: larger than any network of ours; {remedy}")
    check_seal(path, path.read_bytes(), remedy)
    try:
        with safe_open(path, framework="pt") as file:
            texts = dict(file.metadata() or {})
            found = {name: file.get_tensor(name) for name in file.keys()}
    except (SafetensorError, KeyError, TypeError, ValueError, RuntimeError, OSError) as error:
        raise RfgsFormatError(f"{path}: damaged ({type(error).__name__}); {remedy}") from error
    for name, value in found.items():
        if value.is_floating_point() and not bool(torch.isfinite(value.float()).all()):
            raise RfgsFormatError(f"{path}: {name}: holds NaN or infinity; {remedy}")
    return found, texts


def refuse_misfit(
    path: Path, found: Mapping[str, Tensor], wanted: Mapping[str, Tensor], remedy: str
) -> None:
    """Refuses tensors that are not those of a network, or have other shapes or no fractions.

    Args:
        path: The file, for the message.
        found: What it holds.
        wanted: What it should hold, with the shapes that count.
        remedy: What to do about it.

    Raises:
        RfgsFormatError: They do not fit.
    """
    missing, unknown = sorted(wanted.keys() - found.keys()), sorted(found.keys() - wanted.keys())
    if missing or unknown:
        problem = f"{missing[0]!r} is missing" if missing else f"{unknown[0][:60]!r} is unknown"
        raise RfgsFormatError(f"{path}: of another network: {problem}; {remedy}")
    for name, value in wanted.items():
        if found[name].shape != value.shape or not found[name].is_floating_point():
            raise RfgsFormatError(
                f"{path}: {name}: expected numbers with fractions of shape {tuple(value.shape)}, "
                f"found {found[name].dtype} {tuple(found[name].shape)}; {remedy}"
            )
