# SPDX-License-Identifier: Apache-2.0
"""How strongly the radio materials reflect: permittivities and the slab formula."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex128, Float

from rfgs_core.radio.constants import SPEED_OF_LIGHT, VACUUM_PERMITTIVITY
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.tissue import skin_permittivity

#: ITU-R P.2040-4, table 3, the rows below 100 GHz: ε' = a f^b and σ = c f^d [S/m], f in GHz.
_ITU_TERMS: dict[str, tuple[float, float, float, float]] = {
    "concrete": (5.24, 0.0, 0.0462, 0.7822),
    "brick": (3.91, 0.0, 0.0238, 0.16),
    "plasterboard": (2.73, 0.0, 0.0085, 0.9395),
    "wood": (1.99, 0.0, 0.0047, 1.0718),
    "glass": (6.31, 0.0, 0.0036, 1.3394),
    "ceiling_board": (1.48, 0.0, 0.0011, 1.0750),
    "chipboard": (2.58, 0.0, 0.0217, 0.7800),
    "plywood": (2.71, 0.0, 0.33, 0.0),
    "marble": (7.074, 0.0, 0.0055, 0.9262),
    "floorboard": (3.66, 0.0, 0.0044, 1.3515),
    "metal": (1.0, 0.0, 1e7, 0.0),
}


def material_permittivity(
    name: str, freq_hz: Float[np.ndarray, "*shape"]
) -> Complex128[np.ndarray, "*shape"]:
    """Complex relative permittivity ε' − jσ/(ωε₀) of a radio material.

    Args:
        name: One of `materials.MATERIALS`.
        freq_hz: Frequencies within the material's validity [Hz].
    """
    freq_hz = np.asarray(freq_hz, dtype=np.float64)
    if name == "skin":
        return skin_permittivity(freq_hz)
    a, b, c, d = _ITU_TERMS[name]
    freq_ghz = freq_hz / 1e9
    loss = c * freq_ghz**d / (2 * np.pi * freq_hz * VACUUM_PERMITTIVITY)
    return a * freq_ghz**b - 1j * loss


class Slab(NamedTuple):
    """Factors on the electric field at a slab, each complex128, shape (angle, frequency)."""

    reflected_te: np.ndarray
    """Of the field across the plane of incidence, mirrored."""
    reflected_tm: np.ndarray
    """Of the field in that plane, mirrored."""
    passed_te: np.ndarray
    """Of the field across the plane of incidence, passed on."""
    passed_tm: np.ndarray
    """Of the field in that plane, passed on."""


def slab(
    name: str,
    thickness_m: float,
    freq_hz: Float[np.ndarray, "frequency"],
    cosine: Float[np.ndarray, "angle"],
) -> Slab:
    """Reflection and transmission of a slab in air at any angle, ITU-R P.2040-4, section 2.2.2.2.

    With r of the surface, R = r (1 − e^{−j2q}) / (1 − r² e^{−j2q}) and
    T = (1 − r²) e^{−jq} / (1 − r² e^{−j2q}), q = (2πd/λ) √(η − sin²θ).

    Args:
        name: One of `materials.MATERIALS`.
        thickness_m: Thickness d [m].
        freq_hz: Frequencies within the material's validity [Hz].
        cosine: Cosines of the angles of incidence, 0 to 1.
    """
    eta = material_permittivity(name, freq_hz)
    cosine = np.asarray(cosine, dtype=np.float64)[:, None]
    root = np.sqrt(eta - (1.0 - cosine**2))
    wavenumber = 2.0 * np.pi * np.asarray(freq_hz, dtype=np.float64) / SPEED_OF_LIGHT
    # √ of a lossy material has a negative imaginary part: the wave fades on its way.
    once = np.exp(-1j * wavenumber * thickness_m * root)
    factors = []
    for surface in (
        (cosine - root) / (cosine + root),
        (eta * cosine - root) / (eta * cosine + root),
    ):
        rest = 1.0 - surface**2 * once**2
        factors.append((surface * (1.0 - once**2) / rest, (1.0 - surface**2) * once / rest))
    (reflected_te, passed_te), (reflected_tm, passed_tm) = factors
    return Slab(reflected_te, reflected_tm, passed_te, passed_tm)


#: Slabs that leave less of an amplitude count as closed: −30 dB.
_CLOSED = 0.03


def slab_delay_s(slabs: Iterable[tuple[str, float]], freq_hz: float) -> float:
    """Longest time d √ε′ / c that a wave takes through any slab that passes some of it [s].

    Args:
        slabs: Material, one of `materials.MATERIALS`, and thickness d [m] of each.
        freq_hz: Frequency within the materials' validity [Hz].
    """
    at, longest_s = np.array([freq_hz]), 0.0
    for name, thickness_m in slabs:
        if abs(slab(name, thickness_m, at, np.ones(1)).passed_te[0, 0]) > _CLOSED:
            index = float(np.sqrt(material_permittivity(name, at))[0].real)
            longest_s = max(longest_s, thickness_m * index / SPEED_OF_LIGHT)
    return longest_s


def slab_reflection(
    name: str, freq_hz: Float[np.ndarray, "*shape"]
) -> Complex128[np.ndarray, "*shape"]:
    """Reflection of a slab of a material's usual thickness d at normal incidence.

    Args:
        name: One of `materials.MATERIALS`, which tells the thickness.
        freq_hz: Frequencies within the material's validity [Hz].
    """
    freq_hz = np.asarray(freq_hz, dtype=np.float64)
    thickness_m = MATERIALS[name].thickness_m
    found = slab(name, thickness_m, freq_hz.ravel(), np.ones(1)).reflected_te[0]
    return found.reshape(freq_hz.shape)
