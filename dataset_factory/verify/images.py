# SPDX-License-Identifier: Apache-2.0
"""A closed box by image sources: every path of so many reflections, with its polarisation."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from dataset_factory.verify.closed_forms import C, friis


@dataclass(frozen=True)
class Box:
    """A box from the origin whose six walls are slabs of one material."""

    size_m: tuple[float, float, float]
    """Edge lengths [m]."""
    material: str
    """Name of `slabs`' table."""
    thickness_m: float
    """Thickness of its walls [m]."""


def image_paths(
    box: Box, tx: np.ndarray, rx: np.ndarray, order: int
) -> list[tuple[np.ndarray, list[int]]]:
    """Way of each path in unfolded space, and the axes of the walls it meets, in order.

    The receiver's images are at nL + x for even n and nL + L − x for odd n along each axis; a path
    to the image (n_x, n_y, n_z) is reflected |n_x| + |n_y| + |n_z| times.

    Args:
        box: The box.
        tx: Transmitter [m], shape (3,).
        rx: Receiver [m], shape (3,).
        order: Most reflections of a path.

    Returns:
        For each path its way from the transmitter [m], shape (3,), and the axes it is
        reflected across.
    """
    size = np.array(box.size_m)
    paths = []
    for cell in product(range(-order, order + 1), repeat=3):
        count = np.array(cell)
        if np.abs(count).sum() > order:
            continue
        image = count * size + np.where(count % 2 == 0, rx, size - rx)
        way = image - tx
        crossings = []
        for axis in range(3):
            # Walls are crossed at L, 2L, … upwards and at 0, −L, … downwards.
            up = count[axis] > 0
            planes = np.arange(1, count[axis] + 1) if up else np.arange(count[axis] + 1, 1)
            crossings += [((n * size[axis] - tx[axis]) / way[axis], axis) for n in planes]
        paths.append((way, [axis for _, axis in sorted(crossings)]))
    return paths


def box_channel(
    box: Box,
    tx: np.ndarray,
    rx: np.ndarray,
    freq_hz: np.ndarray,
    polarisation: str = "V",
    order: int = 3,
) -> np.ndarray:
    """Channel between isotropic antennas in a box, complex128, shape (f,).

    At each wall the field is split into TE and TM and multiplied by the slab's coefficients
    (Balanis, Advanced Engineering Electromagnetics, 1989, section 5.3).

    Args:
        box: The box.
        tx: Transmitter [m], shape (3,).
        rx: Receiver [m], shape (3,).
        freq_hz: Frequencies [Hz], shape (f,).
        polarisation: V, along θ of the vertical, or H, along φ.
        order: Most reflections of a path.
    """
    total = np.zeros(len(freq_hz), dtype=np.complex128)
    for way, axes in image_paths(box, tx, rx, order):
        length = float(np.linalg.norm(way))
        k = way / length
        wave = np.repeat(_field(polarisation, k)[:, None].astype(complex), len(freq_hz), axis=1)
        for axis in axes:
            wave, k = _reflected(wave, k, axis, box, freq_hz)
        total += friis(freq_hz, length) * (_field(polarisation, -k) @ wave)
    return total


def delays_s(box: Box, tx: np.ndarray, rx: np.ndarray, order: int = 3) -> np.ndarray:
    """Delays of all paths of a box [s], ascending."""
    ways = [way for way, _ in image_paths(box, tx, rx, order)]
    return np.sort(np.linalg.norm(ways, axis=1)) / C


def _field(polarisation: str, k: np.ndarray) -> np.ndarray:
    """Unit field of an upright isotropic antenna in a direction that leaves it, shape (3,)."""
    flat = np.hypot(k[0], k[1])
    if polarisation == "V":
        return np.array([k[2] * k[0] / flat, k[2] * k[1] / flat, -flat])
    return np.array([-k[1] / flat, k[0] / flat, 0.0])


def _reflected(
    wave: np.ndarray, k: np.ndarray, axis: int, box: Box, freq_hz: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Field and direction after a wall across an axis; the field's shape is (3, f)."""
    normal = np.eye(3)[axis]
    across = np.cross(k, normal)
    # At normal incidence any direction in the wall is across.
    across = across if np.linalg.norm(across) > 1e-9 else np.eye(3)[(axis + 1) % 3]
    across = across / np.linalg.norm(across)
    out = k - 2.0 * k[axis] * normal
    te, tm = slab(box.material, box.thickness_m, freq_hz, abs(float(k[axis])))
    along_in, along_out = np.cross(across, k), np.cross(across, out)
    reflected = np.outer(across, te * (across @ wave)) + np.outer(along_out, tm * (along_in @ wave))
    return reflected, out


#: ITU-R P.2040-3, table 3: ε' = a f^b and σ = c f^d [S/m], f in GHz.
_TABLE = {
    "concrete": (5.24, 0.0, 0.0462, 0.7822),
    "plasterboard": (2.73, 0.0, 0.0085, 0.9395),
    "wood": (1.99, 0.0, 0.0047, 1.0718),
    "glass": (6.31, 0.0, 0.0036, 1.3394),
    "metal": (1.0, 0.0, 1e7, 0.0),
}
#: Permittivity of vacuum [F/m] (CODATA 2018).
_VACUUM = 8.854_187_8128e-12


def permittivity(material: str, freq_hz: np.ndarray) -> np.ndarray:
    """Complex relative permittivity η = ε' − jσ/(ωε₀) (ITU-R P.2040-3, eq. 12, 28, 29).

    Args:
        material: A name of the table.
        freq_hz: Frequencies [Hz], shape (f,).
    """
    a, b, c, d = _TABLE[material]
    freq_ghz = np.asarray(freq_hz, dtype=np.float64) / 1e9
    conductivity = c * freq_ghz**d
    return a * freq_ghz**b - 1j * conductivity / (2.0 * np.pi * freq_ghz * 1e9 * _VACUUM)


def half_space(material: str, freq_hz: np.ndarray, cosine: float) -> tuple[np.ndarray, np.ndarray]:
    """Fresnel's coefficients of a thick body, TE and TM (ITU-R P.2040-3, eq. 31a, 31b).

    Args:
        material: A name of the table.
        freq_hz: Frequencies [Hz], shape (f,).
        cosine: Cosine of the angle of incidence.
    """
    eta = permittivity(material, freq_hz)
    root = np.sqrt(eta - (1.0 - cosine**2))
    te = (cosine - root) / (cosine + root)
    tm = (eta * cosine - root) / (eta * cosine + root)
    return te, tm


def slab(
    material: str, thickness_m: float, freq_hz: np.ndarray, cosine: float
) -> tuple[np.ndarray, np.ndarray]:
    """Reflection of a slab in air, TE and TM (ITU-R P.2040-3, eq. 42a and 43).

    R = R'(1 − e^{−j2q}) / (1 − R'² e^{−j2q}), q = (2πd/λ) √(η − sin²θ).

    Args:
        material: A name of the table.
        thickness_m: Thickness d [m].
        freq_hz: Frequencies [Hz], shape (f,).
        cosine: Cosine of the angle of incidence.
    """
    freq_hz = np.asarray(freq_hz, dtype=np.float64)
    root = np.sqrt(permittivity(material, freq_hz) - (1.0 - cosine**2))
    there_and_back = np.exp(-2j * (2.0 * np.pi * freq_hz / C) * thickness_m * root)
    te, tm = (
        face * (1.0 - there_and_back) / (1.0 - face**2 * there_and_back)
        for face in half_space(material, freq_hz, cosine)
    )
    return te, tm
