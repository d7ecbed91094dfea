# SPDX-License-Identifier: Apache-2.0
"""The Kirchhoff integral over rectangles by plain quadrature: what boxes must scatter like."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Quadrature points per wavelength, along each side.
_PER_WAVELENGTH = 8
#: How far inside a box a ray must pass to be blocked by it [m].
_GRAZING_M = 1e-6


class Rectangle(NamedTuple):
    """A flat face; its outward normal is along side_u × side_v."""

    corner: np.ndarray
    side_u: np.ndarray
    side_v: np.ndarray

    @property
    def normal(self) -> np.ndarray:
        across = np.cross(self.side_u, self.side_v)
        return across / np.linalg.norm(across)


class Box(NamedTuple):
    """A box along the axes."""

    low: np.ndarray
    high: np.ndarray

    @property
    def faces(self) -> list[Rectangle]:
        out = []
        for axis in range(3):
            u, v = (np.eye(3)[(axis + i) % 3] * (self.high - self.low) for i in (1, 2))
            top = np.where(np.arange(3) == axis, self.high, self.low)
            out += [Rectangle(top, u, v), Rectangle(self.low, v, u)]
        return out


def box(size: tuple[float, ...], centre: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Box:
    half, middle = np.array(size) / 2, np.array(centre)
    return Box(middle - half, middle + half)


def mesh_of(boxes: list[Box], cells: int = 1, side_m: float = np.inf) -> tuple:
    """Triangles of all faces: `cells` along each side, more where cells are above `side_m`."""
    vertices, faces, first = [], [], 0
    for face in (face for each in boxes for face in each.faces):
        n, m = (
            max(cells, int(np.ceil(np.linalg.norm(s) / side_m))) for s in (face.side_u, face.side_v)
        )
        u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(m + 1) / m, indexing="ij")
        places = face.corner + u.reshape(-1, 1) * face.side_u + v.reshape(-1, 1) * face.side_v
        quad = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel() + first
        faces += [
            np.stack([quad, quad + m + 1, quad + m + 2], axis=1),
            np.stack([quad, quad + m + 2, quad + 1], axis=1),
        ]
        vertices.append(places)
        first += len(places)
    return np.concatenate(vertices), np.concatenate(faces)


def in_sight(points: np.ndarray, place: np.ndarray, boxes: list[Box]) -> np.ndarray:
    """Whether no box stands between points on boxes and a place, by slabs."""
    way, free = place - points, np.ones(len(points), dtype=bool)
    for each in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            one = (each.low + _GRAZING_M - points) / way
            other = (each.high - _GRAZING_M - points) / way
        enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        free &= ~((leave > np.maximum(enter, 0.0)) & (enter < 1.0))
    return free


def scattered(boxes: list[Box], tx: np.ndarray, rx: np.ndarray, freq_hz: np.ndarray) -> np.ndarray:
    """H / Γ = (j/λ) ∬ (λ/4π) (cos θ_t + cos θ_r)/2 e^{−jk(d_t+d_r)} / (d_t d_r) dA, lit parts only.

    Faces that both ends see are lit; directions and distances are exact at each quadrature point.
    """
    wavenumber = 2.0 * np.pi * freq_hz / SPEED_OF_LIGHT
    step_m = SPEED_OF_LIGHT / freq_hz.max() / _PER_WAVELENGTH
    total = np.zeros(len(freq_hz), dtype=complex)
    for face in (face for each in boxes for face in each.faces):
        n, m = (
            int(np.ceil(np.linalg.norm(side) / step_m)) + 1 for side in (face.side_u, face.side_v)
        )
        u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(m) + 0.5) / m, indexing="ij")
        p = face.corner + u.reshape(-1, 1) * face.side_u + v.reshape(-1, 1) * face.side_v
        p = p[((tx - p) @ face.normal > 0) & ((rx - p) @ face.normal > 0)]
        p = p[in_sight(p, tx, boxes) & in_sight(p, rx, boxes)]
        d_t, d_r = np.linalg.norm(tx - p, axis=1), np.linalg.norm(rx - p, axis=1)
        cosines = (tx - p) @ face.normal / d_t + (rx - p) @ face.normal / d_r
        area = np.linalg.norm(np.cross(face.side_u, face.side_v)) / (n * m)
        size = area * cosines / (8.0 * np.pi * d_t * d_r)
        total += 1j * (size @ np.exp(-1j * np.outer(d_t + d_r, wavenumber)))
    return total
