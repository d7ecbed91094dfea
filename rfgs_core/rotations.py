# SPDX-License-Identifier: Apache-2.0
"""The rotation of a quaternion, for every array library alike."""

from __future__ import annotations

from typing import Any


def rotation_rows(w: Any, x: Any, y: Any, z: Any) -> tuple[tuple[Any, Any, Any], ...]:
    """Rows of the rotation matrix of a unit quaternion; numbers, or arrays of one shape.

    Example:
        >>> rotation_rows(0.0, 0.0, 0.0, 1.0)
        ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
    """
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
