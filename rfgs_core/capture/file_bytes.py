# SPDX-License-Identifier: Apache-2.0
"""Bytes of files that nobody vouches for: bounded before anything is decoded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.capture.model import MOST_VALUES
from rfgs_core.errors import RfgsError, RfgsFormatError

#: Larger files are refused; cut a longer capture into pieces [bytes].
LARGEST_FILE_BYTES = 2**30

#: Bytes from which the kind of a file is told.
HEAD_BYTES = 4096


def read_bytes(path: Path) -> bytes:
    """Reads a whole file of bounded size.

    Raises:
        RfgsError: There is no such file, or it cannot be read.
        RfgsFormatError: It is empty or larger than `LARGEST_FILE_BYTES`.
    """
    data = _read(path, LARGEST_FILE_BYTES + 1)
    if not data:
        raise RfgsFormatError(f"{path}: expected a capture, found an empty file")
    if len(data) > LARGEST_FILE_BYTES:
        raise RfgsFormatError(
            f"{path}: larger than {LARGEST_FILE_BYTES >> 20} MiB; cut the capture into pieces"
        )
    return data


def read_head(path: Path) -> bytes:
    """The first `HEAD_BYTES` of a file; nothing of a folder.

    Raises:
        RfgsError: There is no such file, or it cannot be read.
    """
    return b"" if path.is_dir() else _read(path, HEAD_BYTES)


def refuse_too_many(path: Path, count: int) -> None:
    """Refuses a file whose values would not fit the memory that reading may take.

    Raises:
        RfgsFormatError: There are more than `MOST_VALUES`.
    """
    if count > MOST_VALUES:
        raise RfgsFormatError(
            f"{path}: {count} values, at most {MOST_VALUES} are read from a file; "
            "cut the capture into pieces"
        )


def unwrapped_s(
    ticks: Int64[np.ndarray, "time"], bits: int, tick_s: float
) -> Float64[np.ndarray, "time"]:
    """Seconds since the first packet of a counter that wraps.

    Args:
        ticks: The counter at each packet.
        bits: Its width; it wraps at 2^bits.
        tick_s: Time of one tick [s].

    Returns:
        Never descending: a step back of less than half the counter's range is a packet out of
        order or a damaged counter, and counts as no time at all.
    """
    step = np.diff(np.asarray(ticks, np.int64)) % (1 << bits)
    step[step >= 1 << (bits - 1)] = 0
    return np.concatenate([[0.0], np.cumsum(step, dtype=np.float64)]) * tick_s


def _read(path: Path, count: int) -> bytes:
    if path.exists() and not path.is_file():
        # A pipe would wait for somebody who writes.
        raise RfgsError(f"{path}: expected a file with a capture, found none")
    try:
        with path.open("rb") as stream:
            return stream.read(count)
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file") from error
    except OSError as error:
        raise RfgsError(f"{path}: cannot be read ({error.strerror})") from error
