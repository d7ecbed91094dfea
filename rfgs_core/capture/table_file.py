# SPDX-License-Identifier: Apache-2.0
"""Named arrays of MATLAB and HDF5 files, read by a process with limits of its own."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Literal

import numpy as np

from rfgs_core.capture.file_bytes import LARGEST_FILE_BYTES, read_head
from rfgs_core.errors import RfgsFormatError
from rfgs_core.extras import require

#: Memory and time that reading one file may take.
MEMORY_BYTES = 3 * 2**30
SECONDS = 60

Kind = Literal["mat", "hdf5"]


def read_tables(path: Path, kind: Kind) -> dict[str, np.ndarray]:
    """Reads every array of numbers or text in a file; nothing is unpickled.

    Args:
        path: The file.
        kind: mat (up to version 7.2) or hdf5.

    Returns:
        Arrays by name: `structure.field` of MATLAB, the path within the file of HDF5.

    Raises:
        RfgsError: There is no such file, or the library that reads it is not installed.
        RfgsFormatError: The file is empty, too large or damaged, or reading it took more than
            `MEMORY_BYTES` or `SECONDS`.
    """
    if not read_head(path):
        raise RfgsFormatError(f"{path}: expected a capture, found an empty file")
    if path.stat().st_size > LARGEST_FILE_BYTES:
        raise RfgsFormatError(f"{path}: larger than {LARGEST_FILE_BYTES >> 20} MiB")
    require("h5py" if kind == "hdf5" else "scipy")
    child = Path(__file__).with_name("table_child.py")
    command = [sys.executable, "-P", str(child), kind, str(path), str(MEMORY_BYTES), str(SECONDS)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=2 * SECONDS, check=False)
    except subprocess.TimeoutExpired as error:
        raise RfgsFormatError(
            f"{path}: reading took over {2 * SECONDS} s; is it damaged?"
        ) from error
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        reason = said[-1] if said and done.returncode > 0 else "the library that reads it crashed"
        raise RfgsFormatError(
            f"{path}: expected a whole {_NAMES[kind]} file, found damage ({reason})"
        )
    try:
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise RfgsFormatError(f"{path}: damaged ({error})") from error


_NAMES = {"mat": "MATLAB", "hdf5": "HDF5"}
