# SPDX-License-Identifier: Apache-2.0
"""Sub-seeds of one root seed, the same on every machine."""

from __future__ import annotations

import hashlib


def sub_seed(root_seed: int, *parts: str | int) -> int:
    """Derives a 31-bit seed from a root seed and what it is for.

    Args:
        root_seed: Any integer, 0 included.
        *parts: For example scene, radio, frame number and purpose.

    Returns:
        A seed in [0, 2**31), small enough for Dr.Jit, NumPy and torch alike.

    Example:
        >>> sub_seed(0, "living_room_walk", "wifi", 1) == sub_seed(0, "living_room_walk", "wifi", 1)
        True
    """
    text = "\x1f".join([str(root_seed), *(str(part) for part in parts)])
    return int.from_bytes(hashlib.sha256(text.encode("utf-8")).digest()[:4], "big") >> 1
