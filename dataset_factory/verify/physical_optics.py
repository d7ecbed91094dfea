# SPDX-License-Identifier: Apache-2.0
"""The Kirchhoff integral over boxes by plain quadrature, and the sphere of geometrical optics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dataset_factory.verify.closed_forms import C

#: Quadrature points per wavelength, along each side.
_PER_WAVELENGTH = 8
#: How far inside a box a ray must pass to be blocked by it [m].
_GRAZING_M = 1e-6


class Rectangle(NamedTuple):
    """A flat face; its outward normal is along side_u × side_v."""

    corner: np.ndarray
    """One corner [m], shape (3,)."""
    side_u: np.ndarray
    """Way to the next corner [m], shape (3,)."""
    side_v: np.ndarray
    """Way to the corner before [m], shape (3,)."""

    @property
    def normal(self) -> np.ndarray:
        """Unit outward normal, shape (3,)."""
        across = np.cross(self.side_u, self.side_v)
        return across / np.linalg.norm(across)


class Cuboid(NamedTuple):
    """A box along the axes."""

    low: np.ndarray
    """Lower corner [m], shape (3,)."""
    high: np.ndarray
    """Upper corner [m], shape (3,)."""

    @property
    def faces(self) -> list[Rectangle]:
        """Its six faces."""
        out = []
        for axis in range(3):
            u, v = (np.eye(3)[(axis + i) % 3] * (self.high - self.low) for i in (1, 2))
            top = np.where(np.arange(3) == axis, self.high, self.low)
            out += [Rectangle(top, u, v), Rectangle(self.low, v, u)]
        return out


def cuboid(size: tuple[float, ...], centre: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Cuboid:
    """A box of edge lengths [m] around a centre [m]."""
    half, middle = np.array(size) / 2, np.array(centre)
    return Cuboid(middle - half, middle + half)


def in_sight(points: np.ndarray, place: np.ndarray, boxes: list[Cuboid]) -> np.ndarray:
    """Whether no box stands between points on boxes and a place, by slabs; bool, (point,)."""
    way, free = place - points, np.ones(len(points), dtype=bool)
    for each in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            one = (each.low + _GRAZING_M - points) / way
            other = (each.high - _GRAZING_M - points) / way
        enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        free &= ~((leave > np.maximum(enter, 0.0)) & (enter < 1.0))
    return free


def scattered(
    boxes: list[Cuboid], tx: np.ndarray, rx: np.ndarray, freq_hz: np.ndarray
) -> np.ndarray:
    """Channel by way of boxes over their reflection coefficient, complex128, shape (f,).

    H / Γ = (j/λ) ∬ (λ/4π) (cos θ_t + cos θ_r)/2 e^{−jk(d_t+d_r)} / (d_t d_r) dA over the parts
    that both ends see (physical optics, Balanis 1989, section 7.4); directions and distances are
    exact at each point.

    Args:
        boxes: What scatters.
        tx: Transmitter [m], shape (3,).
        rx: Receiver [m], shape (3,).
        freq_hz: Frequencies [Hz], shape (f,).
    """
    wavenumber = 2.0 * np.pi * freq_hz / C
    step_m = C / freq_hz.max() / _PER_WAVELENGTH
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


def cross_section(
    channel: np.ndarray, freq_hz: np.ndarray, product_m2: float | np.ndarray
) -> np.ndarray:
    """Radar cross-section of an echo [m²], |H|² = λ²σ / ((4π)³ (d_t d_r)²).

    Args:
        channel: Echoes, shape (..., f).
        freq_hz: Frequencies [Hz], shape (f,).
        product_m2: d_t d_r [m²].
    """
    wavelength = C / freq_hz
    return np.abs(channel) ** 2 * (4.0 * np.pi) ** 3 * product_m2**2 / wavelength**2


def sphere_spread_m2(radius_m: float, distance_m: float) -> float:
    """What stands for d_t d_r at a large sphere, which a near antenna sees as curved [m²].

    Its virtual image at d r/(r + 2d) behind the surface gives |H| = λ/(4π) · r / (2d(d + r)) for
    an antenna at distance d from the surface: that of σ = πr² where d_t d_r is d(d + r).

    Args:
        radius_m: Radius r [m].
        distance_m: Distance from antenna to surface d [m].
    """
    return distance_m * (distance_m + radius_m)
