# SPDX-License-Identifier: Apache-2.0
"""What stands around: triangles of walls and furniture, each a slab of a material."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rfgs_core.errors import RfgsError
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.reflection import slab_delay_s
from rfgs_core.simulate.geometry.faces import Faces, faces_of


class SlabMaterial(NamedTuple):
    """A wall's material and thickness."""

    name: str
    """One of `rfgs_core.radio.materials.MATERIALS`."""
    thickness_m: float
    """Thickness of the slab [m]."""


@dataclass(frozen=True)
class Room:
    """Triangles that stand still, for waves to be mirrored by, to pass through and to be hidden."""

    triangles: np.ndarray
    """Corners [m], float64, shape (triangle, 3, 3)."""
    mesh: np.ndarray
    """Mesh of each triangle; faces do not reach from one to another, shape (triangle,)."""
    material: np.ndarray
    """Index into `materials` of each triangle, shape (triangle,)."""
    materials: tuple[SlabMaterial, ...]
    """What the triangles are made of."""
    source: str
    """Where the room comes from, for people: a scene, radio alone, or bounds."""

    def __post_init__(self) -> None:
        """Refuses corners that are not finite and materials that are not known."""
        if not np.isfinite(self.triangles).all():
            bad = np.flatnonzero(~np.isfinite(self.triangles).all(axis=(1, 2)))
            raise RfgsError(f"room: triangle {bad[0]} has a corner that is not a finite number")
        for row in self.materials:
            if row.name not in MATERIALS:
                raise RfgsError(
                    f"room: material {row.name}: expected one of {', '.join(MATERIALS)}"
                )

    @cached_property
    def faces(self) -> Faces:
        """The triangles gathered into plane faces."""
        return faces_of(self.triangles, self.mesh)

    def slab_delay_s(self, freq_hz: float) -> float:
        """Longest time that a wave takes through any slab it passes at a frequency [Hz], [s]."""
        return slab_delay_s((self.materials[i] for i in np.unique(self.material)), freq_hz)


def empty_room(source: str = "nothing around") -> Room:
    """A room without walls: waves go straight."""
    none = np.zeros(0, dtype=np.int64)
    return Room(np.zeros((0, 3, 3)), none, none, (), source)


def box_room(
    low_m: np.ndarray, high_m: np.ndarray, material: SlabMaterial, source: str = "bounds"
) -> Room:
    """A closed box of six slabs.

    Args:
        low_m: Lower corner [m], shape (3,).
        high_m: Upper corner [m], shape (3,).
        material: What its walls are made of.
        source: Where the box comes from.

    Raises:
        RfgsError: The box has no volume.
    """
    low, high = np.asarray(low_m, dtype=np.float64), np.asarray(high_m, dtype=np.float64)
    if not (high > low).all():
        raise RfgsError(f"room: expected a lower corner below the upper one, got {low} and {high}")
    walls = []
    for axis in range(3):
        u, w = (axis + 1) % 3, (axis + 2) % 3
        for level in (low, high):
            corners = np.tile(low, (4, 1))
            corners[:, axis] = level[axis]
            corners[1:3, u], corners[2:, w] = high[u], high[w]
            walls += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    mesh = np.repeat(np.arange(6), 2)
    return Room(np.stack(walls), mesh, np.zeros(12, dtype=np.int64), (material,), source)
