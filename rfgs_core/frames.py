# SPDX-License-Identifier: Apache-2.0
"""Frames as commands name them: `A:B[:STEP]`, both ends included, or one number."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from rfgs_core.errors import RfgsError

_FORM = re.compile(r"(-?\d+)(?::(-?\d+)(?::(\d+))?)?", re.ASCII)
#: More frames than these are not named one by one.
_MOST_LISTED = 16


def parse_frames(text: str) -> range:
    """Frame numbers of `A:B[:STEP]`, B included, or of one number.

    Raises:
        RfgsError: The text is of another form or holds no frame.

    Example:
        >>> list(parse_frames("10:20:5"))
        [10, 15, 20]
    """
    match = _FORM.fullmatch(text)
    if not match:
        raise RfgsError(
            f"--frames {text!r}: expected FIRST:LAST, FIRST:LAST:STEP (as in 1:60:2) or one number"
        )
    first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
    if last < first or step < 1:
        raise RfgsError(f"--frames {text!r}: expected FIRST <= LAST and STEP >= 1")
    return range(first, last + 1, step)


def spread_frames(frames: Sequence[int], most: int) -> list[int]:
    """Frames spread evenly from the first to the last, all of them where there are no more.

    Example:
        >>> spread_frames([10, 15, 20, 25, 30], 3)
        [10, 20, 30]
    """
    rows = np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int)
    return [frames[row] for row in rows.tolist()]


def listed(frames: Sequence[int]) -> str:
    """Frames as a message names them: all of a few, the first and the last of many.

    Example:
        >>> listed([10, 15, 20])
        '10, 15, 20'
        >>> listed(range(1, 61))
        '1, 2, 3, 4, 5, 6, 7, 8, 9, 10, …, 60 (60 frames)'
    """
    if len(frames) <= _MOST_LISTED:
        return ", ".join(map(str, frames))
    return f"{', '.join(map(str, frames[:10]))}, …, {frames[-1]} ({len(frames)} frames)"


def chosen_frames(text: str | None, available: list[int]) -> list[int]:
    """The available frames that a text names, all of them for None.

    Raises:
        RfgsError: The text is of another form, or names no frame there is.
    """
    if text is None:
        return list(available)
    wanted = parse_frames(text)
    frames = [frame for frame in available if frame in wanted]
    if not frames:
        raise RfgsError(f"--frames {text!r}: none of these is there; there are {available}")
    return frames
