# SPDX-License-Identifier: Apache-2.0
"""Numbers as people read them."""

from __future__ import annotations

import math


def number(value: float) -> str:
    """Four significant digits, without a trailing exponent where none is needed.

    Example:
        >>> number(-62.34567), number(0.00012345), number(0.0)
        ('-62.35', '0.0001234', '0')
    """
    if not math.isfinite(value):
        return str(value)
    if value and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.3g}"
    return f"{value:.4g}"
