# SPDX-License-Identifier: Apache-2.0
"""Named arrays in .npz files, whole or absent, without pickle."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import replacing


def save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Writes arrays in one step."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)  # type: ignore[arg-type]


def load_arrays(path: Path, remedy: str) -> dict[str, np.ndarray]:
    """Reads all arrays of a file.

    Args:
        path: The file.
        remedy: What to do about a missing or damaged file, for the message.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: The file is damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file; {remedy}") from error
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        raise RfgsFormatError(f"{path}: damaged ({error}); {remedy}") from error
