# SPDX-License-Identifier: Apache-2.0
"""Facets on the skin of a posed body, and which of them a place sees."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from rfgs_core.articulated import Body, Pose, people, skinned
from rfgs_core.simulate.sight.bodies import picture
from rfgs_core.simulate.surface.lloyd import triangle_areas
from rfgs_core.simulate.surface.points import LIFT_M, SurfacePoints, surface_points

#: Pixels of the picture that tells what the body hides of itself, and how far behind the nearest
#: triangle of a pixel a facet may be [m].
_PIXELS, _BEHIND_M = 96, 0.03
#: Directions that share a cell, in distances between facets, cells along a side, and how far
#: behind the nearest facet of its cell a facet may be and be seen [m]. Beside rays through the
#: skin, 1 % of a body is seen that is not and 3 % is not seen that is.
_CELL, CELLS, BEHIND_M = 1.3, 160, 0.045
#: Bones that carry a facet.
_BONES = 4


@functools.cache
def _scattered(wavelength_m: float) -> SurfacePoints:
    """Points on the mean body, which all bodies share, as the tracers spread them."""
    body = people().body(np.zeros(0))
    count = len(body.faces)
    material, instance = np.zeros(count, np.int64), np.ones(count, np.int64)
    return surface_points(body.vertices, body.faces, material, instance, wavelength_m, seed=0)


class Posed(NamedTuple):
    """A body in the world at one moment."""

    points: Float64[np.ndarray, "facet 3"]
    """Facets, a millimetre outside the skin [m]."""
    normals: Float64[np.ndarray, "facet 3"]
    """Their unit normals."""


class Skin(NamedTuple):
    """All triangles of a posed body."""

    vertices: Float32[np.ndarray, "V 3"]
    """Where they are [m]."""
    faces: Int64[np.ndarray, "face 3"]
    """Vertices of each triangle."""


@dataclass(frozen=True)
class Figure:
    """One body and the facets on it, at rest."""

    body: Body
    points: Float64[np.ndarray, "facet 3"]
    """Facets at rest [m]."""
    normals: Float64[np.ndarray, "facet 3"]
    areas_m2: Float64[np.ndarray, "facet"]
    bone: Int64[np.ndarray, "facet 4"]
    """Bones that carry each facet."""
    weight: Float64[np.ndarray, "facet 4"]
    """Their shares, which sum to 1."""

    @staticmethod
    def of(body: Body, wavelength_m: float) -> Figure:
        """Facets for a shortest wavelength [m] on a body."""
        scattered = _scattered(wavelength_m)
        points, normals = scattered.at(body.vertices)
        mean = people().body(np.zeros(0))
        areas = [triangle_areas(b.vertices.astype(np.float64), b.faces) for b in (body, mean)]
        grown = (areas[0] / np.maximum(areas[1], 1e-12))[scattered.triangle]
        bone, weight = _carried(scattered, body)
        return Figure(body, points, normals, scattered.areas * grown, bone, weight)

    def posed(self, pose: Pose) -> Posed:
        """The body in a pose."""
        turns, moves = self.body.from_rest(pose)
        points = skinned(self.points, self.bone, self.weight, turns, moves)
        normals = skinned(self.normals, self.bone, self.weight, turns, np.zeros_like(moves))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Posed(points + LIFT_M * normals, normals)

    def middle(self, pose: Pose) -> Float64[np.ndarray, "3"]:
        """Centroid of the surface in a pose [m], without posing every facet."""
        turns, moves = self.body.from_rest(pose)
        lever, share = self._borne
        return np.einsum("bij,bj->i", turns, lever) + share @ moves

    @cached_property
    def _borne(self) -> tuple[Float64[np.ndarray, "bone 3"], Float64[np.ndarray, "bone"]]:
        """What each bone bears of the surface: its first moment [m] and its share."""
        borne = self.weight * (self.areas_m2 / self.areas_m2.sum())[:, None]
        lever, share = np.zeros((len(self.body.heads), 3)), np.zeros(len(self.body.heads))
        np.add.at(lever, self.bone, borne[..., None] * self.points[:, None])
        np.add.at(share, self.bone, borne)
        return lever, share


def _carried(
    scattered: SurfacePoints, body: Body
) -> tuple[Int64[np.ndarray, "facet 4"], Float64[np.ndarray, "facet 4"]]:
    """The bones that carry most of each facet: those of the corners of its triangle."""
    bone, weight = body.weights
    full = np.zeros((len(bone), len(body.heads)))
    np.put_along_axis(full, bone.astype(np.int64), weight.astype(np.float64), axis=1)
    shares = np.einsum("pc,pcb->pb", scattered.barycentric, full[scattered.faces])
    top = np.argsort(-shares, axis=1)[:, :_BONES]
    chosen = np.maximum(np.take_along_axis(shares, top, axis=1), 0.0)
    return top, chosen / chosen.sum(axis=1, keepdims=True)


def look_cell(facets: int, areas_m2: float) -> float:
    """Width of a cell of direction that `seen_among` takes, at the body's distance [m].

    Args:
        facets: How many there are.
        areas_m2: Area of the skin that they stand for [m²].
    """
    return _CELL * math.sqrt(areas_m2 / facets)


@numba.njit(cache=True, nogil=True)
def seen_among(
    points: np.ndarray, normals: np.ndarray, place: np.ndarray, cell_m: float
) -> np.ndarray:
    """Facets that face a place and that nothing of the body hides from it, shape (facet,).

    The facets themselves are what hides: of those in one cell of direction whoever is `BEHIND_M`
    behind the nearest is hidden.

    Args:
        points: Facets [m], shape (facet, 3).
        normals: Their normals, shape (facet, 3).
        place: Where from [m], shape (3,).
        cell_m: Width of a cell, from `look_cell` [m].
    """
    nearest = np.full((CELLS, CELLS), np.inf)
    cell = np.full((2, len(points)), -1, dtype=np.int64)
    away = np.zeros(len(points))
    middle = -place.astype(np.float64)
    for i in range(len(points)):
        for axis in range(3):
            middle[axis] += points[i, axis] / len(points)
    flat = math.sqrt(middle[0] ** 2 + middle[1] ** 2)
    azimuth, elevation = math.atan2(middle[1], middle[0]), math.atan2(middle[2], flat)
    width = cell_m / math.sqrt(flat * flat + middle[2] ** 2)
    for i in range(len(points)):
        x, y, z = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        if x * normals[i, 0] + y * normals[i, 1] + z * normals[i, 2] >= 0.0:
            continue
        flat = math.sqrt(x * x + y * y)
        away[i] = math.sqrt(flat * flat + z * z)
        turn = math.atan2(y, x) - azimuth
        turn -= 2.0 * math.pi * round(turn / (2.0 * math.pi))
        column = int(turn / width + 0.5 * CELLS)
        row = int((math.atan2(z, flat) - elevation) / width + 0.5 * CELLS)
        cell[0, i], cell[1, i] = min(max(row, 0), CELLS - 1), min(max(column, 0), CELLS - 1)
        nearest[cell[0, i], cell[1, i]] = min(nearest[cell[0, i], cell[1, i]], away[i])
    seen = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        seen[i] = cell[0, i] >= 0 and away[i] <= nearest[cell[0, i], cell[1, i]] + BEHIND_M
    return seen


def seen_from(
    posed: Posed, skin: Skin, place: Float64[np.ndarray, "3"]
) -> Bool[np.ndarray, "facet"]:
    """Facets that face a place [m] and that no triangle of the skin hides from it."""
    low, high = posed.points.min(axis=0), posed.points.max(axis=0)
    centre, radius = 0.5 * (low + high), 0.55 * float(np.linalg.norm(high - low))
    drawn = picture(*skin, place, centre, radius, _PIXELS)
    return _in_view(posed.points, posed.normals, place, drawn.axes, drawn.per_pixel, drawn.depth)


@numba.njit(cache=True, nogil=True)
def _in_view(
    points: np.ndarray,
    normals: np.ndarray,
    place: np.ndarray,
    axes: np.ndarray,
    per_pixel: float,
    depth: np.ndarray,
) -> np.ndarray:
    """Whether each point faces the place of a picture and is among what is nearest in it."""
    size = len(depth)
    seen = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        way = points[i] - place
        if way[0] * normals[i, 0] + way[1] * normals[i, 1] + way[2] * normals[i, 2] >= 0.0:
            continue
        forward = axes[2, 0] * way[0] + axes[2, 1] * way[1] + axes[2, 2] * way[2]
        if forward <= 0.0:
            continue
        right = axes[0, 0] * way[0] + axes[0, 1] * way[1] + axes[0, 2] * way[2]
        up = axes[1, 0] * way[0] + axes[1, 1] * way[1] + axes[1, 2] * way[2]
        x = int(min(max(right / (forward * per_pixel) + 0.5 * size, 0.0), size - 1.0))
        y = int(min(max(up / (forward * per_pixel) + 0.5 * size, 0.0), size - 1.0))
        near = depth[y, x]
        seen[i] = near <= 0.0 or forward <= 1.0 / near + _BEHIND_M
    return seen
