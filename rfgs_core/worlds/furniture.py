# SPDX-License-Identifier: Apache-2.0
"""Random rooms of slabs, with furniture as boxes that stand clear of people and devices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from rfgs_core.radio import Radio
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.simulate.geometry.room import Room, SlabMaterial, box_room
from rfgs_core.worlds.motion.curves import Z, about

#: What walls, floors and ceilings are made of; those that a radio's band allows are drawn from.
WALLS = ("concrete", "brick", "plasterboard", "wood", "glass")
FLOORS, CEILINGS = ("concrete", "wood"), ("concrete", "ceiling_board", "plasterboard")
#: The first parts of every room.
_SIDES = ("wall_x_low", "wall_x_high", "wall_y_low", "wall_y_high", "floor", "ceiling")
#: The skin of people, last among the materials of every world.
SKIN = "skin"
#: Furniture stands this high above the floor and this far from walls, people and devices [m].
_FEET_M, _FROM_WALL_M, _CLEAR_M = 0.02, 0.05, 0.15
#: Pieces at most, and places tried for each.
_MOST_PIECES, _TRIES = 6, 30


class Kind(NamedTuple):
    """A kind of furniture: material, and its least and greatest size [m]."""

    name: str
    material: str
    least_m: tuple[float, float, float]
    most_m: tuple[float, float, float]


#: A table is its top alone: legs are thin.
KINDS = (
    Kind("wardrobe", "chipboard", (0.4, 0.6, 1.5), (0.65, 1.6, 2.1)),
    Kind("sideboard", "wood", (0.35, 0.8, 0.5), (0.5, 1.8, 1.0)),
    Kind("sofa", "chipboard", (0.7, 1.2, 0.4), (0.95, 2.2, 0.8)),
    Kind("cabinet", "metal", (0.3, 0.4, 0.6), (0.5, 0.9, 1.9)),
    Kind("table", "wood", (0.6, 0.8, 0.7), (0.9, 1.8, 0.76)),
)
_TABLE_TOP_M = 0.04


@dataclass(frozen=True)
class Mesh:
    """A part of a room that stands still."""

    name: str
    material: int
    """Index into the materials of the room."""
    triangles: Float64[np.ndarray, "triangle 3 3"]
    """Corners [m]."""


@dataclass
class Setting:
    """A room in the making: its parts, and the boxes on the floor that are taken."""

    bounds_m: Float64[np.ndarray, "2 3"]
    """Where its six sides are [m]; the floor is z = 0."""
    materials: list[SlabMaterial]
    parts: list[Mesh] = field(default_factory=list)
    taken_m: list[Float64[np.ndarray, "2 2"]] = field(default_factory=list)
    """Lowest and highest corner of each, from above [m]."""

    def room(self) -> Room:
        """The room as the fast tracer takes it."""
        counts = [len(part.triangles) for part in self.parts]
        return Room(
            np.concatenate([part.triangles for part in self.parts]),
            np.repeat(np.arange(len(counts)), counts),
            np.repeat([part.material for part in self.parts], counts),
            tuple(self.materials),
            "a random world",
        )

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices [m], float32, (V, 3), and triangles, int32, (T, 3), of all parts."""
        corners = np.concatenate([part.triangles for part in self.parts]).reshape(-1, 3)
        return corners.astype(np.float32), _rows_of_three(len(corners)).astype(np.int32)

    def add_box(
        self,
        name: str,
        material: str,
        low_m: np.ndarray,
        high_m: np.ndarray,
        turn_rad: float = 0.0,
        shift_m: np.ndarray | None = None,
    ) -> None:
        """Adds a closed box of a material's usual thickness.

        Args:
            name: What it is.
            material: Of what.
            low_m: Its lowest corner, before it is turned [m].
            high_m: Its highest [m].
            turn_rad: How far it is turned about the vertical through the origin [rad].
            shift_m: Where the origin is then put, shape (3,) [m].
        """
        slab = _slab(material)
        if slab not in self.materials:
            self.materials.append(slab)
        box = box_room(low_m, high_m, slab).triangles @ about(Z, turn_rad).T
        box = box if shift_m is None else box + shift_m
        self.parts.append(Mesh(name, self.materials.index(slab), box))

    def clear_of_furniture(self, point_m: np.ndarray, clear_m: float) -> bool:
        """Whether a point keeps clear of the boxes around all furniture so far [m]."""
        corners = [part.triangles.reshape(-1, 3) for part in self.parts[len(_SIDES) :]]
        return not any(
            (point_m > each.min(axis=0) - clear_m).all()
            and (point_m < each.max(axis=0) + clear_m).all()
            for each in corners
        )

    def free(self, low_m: np.ndarray, high_m: np.ndarray, clear_m: float = _CLEAR_M) -> bool:
        """Whether a box, seen from above, keeps clear of all that is taken [m]."""
        return not any(
            (low_m - clear_m < high).all() and (high_m + clear_m > low).all()
            for low, high in self.taken_m
        )


def empty_setting(
    rng: np.random.Generator,
    radio: Radio,
    bounds_m: Float64[np.ndarray, "2 3"] | None = None,
) -> Setting:
    """Four walls of one material, or of several, a floor and a ceiling.

    Args:
        rng: Where chance comes from.
        radio: Walls are of materials whose model covers its band.
        bounds_m: Where the sides are [m]; None draws them, 3 to 9 m apart.
    """
    bounds = _extent(rng) if bounds_m is None else bounds_m
    walls = _allowed(WALLS, radio)
    usual = rng.choice(walls)
    sides = [str(usual if rng.random() < 0.7 else rng.choice(walls)) for _ in range(4)]
    sides += [str(rng.choice(_allowed(names, radio))) for names in (FLOORS, CEILINGS)]
    setting = Setting(bounds, [])
    box = box_room(bounds[0], bounds[1], _slab(sides[0])).triangles
    for index, (name, material) in enumerate(zip(_SIDES, sides, strict=True)):
        slab = _slab(material)
        if slab not in setting.materials:
            setting.materials.append(slab)
        which = setting.materials.index(slab)
        setting.parts.append(Mesh(name, which, box[2 * index : 2 * index + 2]))
    return setting


def _extent(rng: np.random.Generator) -> Float64[np.ndarray, "2 3"]:
    """Where the sides of a random room are [m]."""
    half = rng.uniform(1.6, 3.8, 2) if rng.random() < 0.8 else rng.uniform(2.5, 4.5, 2)
    return np.array([[*-half, 0.0], [*half, rng.uniform(2.4, 3.4)]])


def furnish(rng: np.random.Generator, setting: Setting) -> None:
    """Puts up to six pieces where nobody walks and no device stands, most of them at walls."""
    for number in range(int(rng.integers(0, _MOST_PIECES + 1))):
        kind = KINDS[int(rng.integers(len(KINDS)))]
        size = rng.uniform(kind.least_m, kind.most_m)
        for _ in range(_TRIES):
            low = _spot(rng, setting.bounds_m, size, at_wall=kind.name != "table")
            if low is None or not setting.free(low, low + size[:2]):
                continue
            setting.taken_m.append(np.array([low, low + size[:2]]))
            bottom = size[2] - _TABLE_TOP_M if kind.name == "table" else _FEET_M
            setting.add_box(
                f"{kind.name}_{number}", kind.material,
                np.append(low, bottom), np.append(low + size[:2], size[2]),
            )  # fmt: skip
            break


def _spot(
    rng: np.random.Generator, bounds_m: np.ndarray, size_m: np.ndarray, *, at_wall: bool
) -> np.ndarray | None:
    """Lowest corner from above of a piece [m], turned by a quarter where its wall asks for it."""
    axis, side = int(rng.integers(2)), int(rng.integers(2))
    if axis == 1:
        size_m[:2] = size_m[1::-1]
    low, high = bounds_m[0, :2] + _FROM_WALL_M, bounds_m[1, :2] - _FROM_WALL_M - size_m[:2]
    if (high <= low).any() or size_m[2] > bounds_m[1, 2] - 0.1:
        return None
    spot = rng.uniform(low, high)
    if at_wall:
        spot[axis] = (low, high)[side][axis]
    return spot


def _allowed(names: tuple[str, ...], radio: Radio) -> list[str]:
    """Materials whose model covers a radio's band."""
    return [name for name in names if MATERIALS[name].covers(radio)]


def _slab(name: str) -> SlabMaterial:
    return SlabMaterial(name, MATERIALS[name].thickness_m)


def _rows_of_three(count: int) -> Int64[np.ndarray, "triangle 3"]:
    """Triangles of corners that nobody shares."""
    return np.arange(count).reshape(-1, 3)
