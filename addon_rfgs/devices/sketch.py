# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn of a device: its antenna elements to scale, and where it looks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..tables import MOST_ELEMENTS
from .layout import arrays_of, centre_m, spacing_m, wavelength_m, width_m, world_elements

#: Side of the square that stands for an element, as a share of the elements' distance.
_SQUARE = 0.5
#: Side of the square of an element without near neighbours, in wavelengths.
_LARGEST = 0.25
#: The boresight is drawn at least so long [m], and beyond this many widths of the device.
_SHORTEST_M, _WIDTHS = 0.35, 0.75
#: Length and half width of the arrow's head, as a share of the arrow.
_HEAD = 0.22, 0.07


@dataclass(frozen=True)
class Sketch:
    """Line segments [N, 2, 3] of one or more devices, in metres."""

    tx: np.ndarray
    """Squares around transmitting elements."""
    rx: np.ndarray
    """Squares around receiving elements."""
    boresight: np.ndarray
    """Arrows along local +X."""


def sketch(fields: Mapping[str, Any], role: str, pose: np.ndarray) -> Sketch:
    """Lines of one device.

    Args:
        fields: Of its radio.
        role: Which arrays it uses.
        pose: Rigid world_from_device [4, 4] in metres.
    """
    used = arrays_of(role)
    squares = {
        array: _squares(fields, array, pose) if array in used else np.zeros((0, 2, 3))
        for array in ("tx", "rx")
    }
    # A device that only sends does so from its TX array, beside its origin.
    start = pose[:3, :3] @ centre_m(fields, used[-1]) + pose[:3, 3]
    length = max(_SHORTEST_M, _WIDTHS * width_m(fields))
    return Sketch(squares["tx"], squares["rx"], _arrow(start, pose[:3, :3], length))


def joined(sketches: Iterable[Sketch]) -> Sketch:
    """All lines of several devices."""
    rows = list(sketches)
    none = [np.zeros((0, 2, 3))]
    return Sketch(
        np.concatenate([*none, *(row.tx for row in rows)]),
        np.concatenate([*none, *(row.rx for row in rows)]),
        np.concatenate([*none, *(row.boresight for row in rows)]),
    )


def _squares(fields: Mapping[str, Any], array: str, pose: np.ndarray) -> np.ndarray:
    """Sides [4 N, 2, 3] of a square around each element, in the array's plane.

    Arrays that nothing can trace are not drawn either: one wrong digit would halt the view.
    """
    if fields[f"{array}_rows"] * fields[f"{array}_cols"] > MOST_ELEMENTS:
        return np.zeros((0, 2, 3))
    side = min(_SQUARE * spacing_m(fields, array), _LARGEST * wavelength_m(fields))
    corners = 0.5 * side * np.array([(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)])
    ring = corners @ pose[:3, :3].T
    edges = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
    return (world_elements(fields, array, pose)[:, None, None] + edges).reshape(-1, 2, 3)


def _arrow(start: np.ndarray, axes: np.ndarray, length: float) -> np.ndarray:
    """Shaft and head [5, 2, 3] of an arrow along the first column of `axes` [3, 3]."""
    tip = start + length * axes[:, 0]
    foot = tip - _HEAD[0] * length * axes[:, 0]
    barbs = [
        foot + sign * _HEAD[1] * length * axes[:, column] for column in (1, 2) for sign in (-1, 1)
    ]
    return np.array([(start, tip), *((barb, tip) for barb in barbs)])
