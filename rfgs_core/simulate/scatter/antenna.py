# SPDX-License-Identifier: Apache-2.0
"""Antennas as compiled code; the twin of `rfgs_core.radio.antennas.field`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from rfgs_core.radio.antennas import PATTERNS

#: Codes of the patterns.
CODES = {name: code for code, name in enumerate(PATTERNS)}
_ISO, _DIPOLE, _HW_DIPOLE, _TR38901 = (
    CODES[name] for name in ("iso", "dipole", "hw_dipole", "tr38901")
)


class Antenna(NamedTuple):
    """One port of a site."""

    pattern: int
    """Code of its pattern, see `CODES`."""
    slant: tuple[float, float]
    """Cosine and sine of the slant of its polarisation."""
    axes: np.ndarray
    """Rotation world_from_device, shape (3, 3)."""
    reach_m: float
    """Largest distance of an element from the centre [m]."""


@numba.njit(cache=True, nogil=True)
def sent_towards(antenna: Antenna, way: np.ndarray) -> tuple[float, float, float]:
    """Field that the antenna sends in a direction, or hears from it.

    Args:
        antenna: The antenna.
        way: Direction away from it, of any length, shape (3,).
    """
    r = antenna.axes
    d = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    x = (r[0, 0] * way[0] + r[1, 0] * way[1] + r[2, 0] * way[2]) / d
    y = (r[0, 1] * way[0] + r[1, 1] * way[1] + r[2, 1] * way[2]) / d
    z = (r[0, 2] * way[0] + r[1, 2] * way[1] + r[2, 2] * way[2]) / d
    flat = math.hypot(x, y)
    cos_phi, sin_phi = (x / flat, y / flat) if flat > 1e-7 else (1.0, 0.0)
    strength = _strength(antenna.pattern, min(max(z, -1.0), 1.0), x, y)
    along, across = antenna.slant[0] * strength, antenna.slant[1] * strength
    fx = along * z * cos_phi - across * sin_phi
    fy = along * z * sin_phi + across * cos_phi
    fz = -along * flat
    return (
        r[0, 0] * fx + r[0, 1] * fy + r[0, 2] * fz,
        r[1, 0] * fx + r[1, 1] * fy + r[1, 2] * fz,
        r[2, 0] * fx + r[2, 1] * fy + r[2, 2] * fz,
    )


@numba.njit(cache=True, nogil=True)
def _strength(pattern: int, cosine: float, x: float, y: float) -> float:
    """Magnitude of a pattern at the cosine of the zenith angle and beside it."""
    if pattern == _ISO:
        return 1.0
    sine = math.sqrt(1.0 - cosine * cosine)
    if pattern == _DIPOLE:
        return math.sqrt(1.5) * sine
    if pattern == _HW_DIPOLE:
        if sine < 1e-5:
            return 0.0
        return math.sqrt(1.643) * abs(math.cos(0.5 * math.pi * cosine) / sine)
    width = math.radians(65.0)
    vertical_db = min(12.0 * ((math.acos(cosine) - 0.5 * math.pi) / width) ** 2, 30.0)
    horizontal_db = min(12.0 * (math.atan2(y, x) / width) ** 2, 30.0)
    return 10.0 ** ((8.0 - min(vertical_db + horizontal_db, 30.0)) / 20.0)
