# SPDX-License-Identifier: Apache-2.0
"""What moves, on disk: one `.npz` file per frame, and the triangles that all frames share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.arrays import Shape, load_arrays

_REMEDY = "the geometry of this dataset is missing or damaged, make the dataset again"
_TOPOLOGY: dict[str, Shape] = {"faces": ("face", 3), "instance": ("face",)}
_FRAME: dict[str, Shape | None] = {
    "vertices": ("vertex", 3),
    "joints": ("person", 17, 3),
    "person_instance": ("person",),
    "action": None,
}
_FRAME_TYPES = {"vertices": "f4", "joints": "f4", "person_instance": "i4"}
_VELOCITY: dict[str, Shape] = {"segment_velocity": ("person", 17, 3)}


def read_topology(path: Path) -> dict[str, np.ndarray]:
    """Triangles (`faces`) and the instance of each.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged, or an array is not as it should be.
    """
    return load_arrays(path, _REMEDY, _TOPOLOGY, types=dict.fromkeys(_TOPOLOGY, "i4"), seal=False)


def read_geometry(path: Path) -> dict[str, np.ndarray]:
    """Vertices, joints, instances and actions of a frame, refused like `read_topology`."""
    return load_arrays(path, _REMEDY, _FRAME, ("joints",), types=_FRAME_TYPES, seal=False)


def read_segment_velocity(path: Path) -> np.ndarray:
    """Velocity of each body segment's skin [m/s], refused like `read_topology`."""
    types = dict.fromkeys(_VELOCITY, "f4")
    return load_arrays(path, _REMEDY, _VELOCITY, tuple(_VELOCITY), types=types, seal=False)[
        "segment_velocity"
    ]
