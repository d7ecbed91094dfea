# SPDX-License-Identifier: Apache-2.0
"""The rotation of a quaternion, for every array library alike."""

from __future__ import annotations

import math
from typing import Any


def of_unit_length(
    quat_wxyz: tuple[float, float, float, float],
) -> tuple[float, float, float, float]:
    """The same rotation by a quaternion of unit length; what is, but for rounding, stays as it is.

    Example:
        >>> of_unit_length((2.0, 0.0, 0.0, 0.0))
        (1.0, 0.0, 0.0, 0.0)
    """
    size = math.hypot(*quat_wxyz)
    if abs(size - 1.0) < 1e-6:
        return quat_wxyz
    w, x, y, z = quat_wxyz
    return w / size, x / size, y / size, z / size


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
