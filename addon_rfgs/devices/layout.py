# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the antenna elements of a device are, as the dataset factory lays them out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..tables import SPEED_OF_LIGHT


def wavelength_m(fields: Mapping[str, Any]) -> float:
    """Wavelength at the middle of a radio's band [m]."""
    return 2.0 * SPEED_OF_LIGHT / (fields["freq_min_hz"] + fields["freq_max_hz"])


def spacing_m(fields: Mapping[str, Any], array: str) -> float:
    """Distance of neighbouring elements [m] of the `tx` or the `rx` array; 0 means λ/2."""
    return fields[f"{array}_spacing_m"] or 0.5 * wavelength_m(fields)


def local_elements(fields: Mapping[str, Any], array: str) -> np.ndarray:
    """Element positions [N, 3] of the `tx` or the `rx` array in the device's axes [m].

    Elements lie in the local y-z plane, column by column, starting at (-y, +z).
    """
    rows, cols = fields[f"{array}_rows"], fields[f"{array}_cols"]
    column, row = np.divmod(np.arange(rows * cols), rows)
    pitch = spacing_m(fields, array)
    y = (column - 0.5 * (cols - 1)) * pitch
    z = -(row - 0.5 * (rows - 1)) * pitch
    return np.stack([np.zeros_like(y), y, z], axis=1) + centre_m(fields, array)


def centre_m(fields: Mapping[str, Any], array: str) -> np.ndarray:
    """Middle of an array [3] in the device's axes [m]."""
    return np.array(fields["tx_offset_m"] if array == "tx" else (0.0, 0.0, 0.0))


def arrays_of(role: str) -> tuple[str, ...]:
    """Which arrays a device of a role uses: `tx`, `rx` or both."""
    return {"TRANSMITTER": ("tx",), "RECEIVER": ("rx",), "ACCESS_POINT": ("tx", "rx")}[role]


def world_elements(fields: Mapping[str, Any], array: str, pose: np.ndarray) -> np.ndarray:
    """Element positions [N, 3] in the world [m].

    Args:
        fields: Of a radio.
        array: `tx` or `rx`.
        pose: Rigid world_from_device [4, 4] in metres.
    """
    return local_elements(fields, array) @ pose[:3, :3].T + pose[:3, 3]


def width_m(fields: Mapping[str, Any]) -> float:
    """Extent of all elements of a device along its local y [m]."""
    ends = []
    for array in ("tx", "rx"):
        half = 0.5 * (fields[f"{array}_cols"] - 1) * spacing_m(fields, array)
        middle = centre_m(fields, array)[1]
        ends += [middle - half, middle + half]
    return float(np.ptp(ends))
