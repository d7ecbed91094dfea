# SPDX-License-Identifier: Apache-2.0
"""Slabs of building materials after ITU-R P.2040, written apart from the tracer's own tables."""

from __future__ import annotations

import numpy as np

from dataset_factory.verify.closed_forms import C

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
