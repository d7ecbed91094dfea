# SPDX-License-Identifier: Apache-2.0
"""Dielectric properties of human skin, and how strongly it reflects."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex128, Float

from rfgs_core.radio.constants import VACUUM_PERMITTIVITY

#: Dry skin, Gabriel et al., Phys. Med. Biol. 41 (1996) 2271, table 1: strength, relaxation
#: time [s] and broadening of each of the four Cole-Cole terms.
_SKIN_TERMS = (
    (32.0, 7.234e-12, 0.0),
    (1100.0, 32.481e-9, 0.2),
    (0.0, 159.155e-6, 0.2),
    (0.0, 15.915e-3, 0.2),
)
_SKIN_EPSILON_INFINITY = 4.0
_SKIN_IONIC_CONDUCTIVITY = 2.0e-4


def skin_permittivity(freq_hz: Float[np.ndarray, "*shape"]) -> Complex128[np.ndarray, "*shape"]:
    """Complex relative permittivity of dry skin.

    ε(ω) = ε∞ + Σ_n Δε_n / (1 + (jωτ_n)^(1−α_n)) + σ_i / (jωε_0), equation 4 of Gabriel et al.
    (1996), time convention e^{+jωt}, so the imaginary part is negative.

    Args:
        freq_hz: Frequencies [Hz], 10 Hz to 100 GHz.

    Returns:
        ε' − jε'', of the shape of `freq_hz`.

    Example:
        >>> bool(abs(skin_permittivity(np.array([5.8e9]))[0].real - 35.1) < 0.1)
        True
    """
    omega = 2.0 * np.pi * np.asarray(freq_hz, dtype=np.float64)
    epsilon = np.full(omega.shape, _SKIN_EPSILON_INFINITY, dtype=np.complex128)
    for strength, tau_s, alpha in _SKIN_TERMS:
        epsilon += strength / (1.0 + (1j * omega * tau_s) ** (1.0 - alpha))
    return epsilon + _SKIN_IONIC_CONDUCTIVITY / (1j * omega * VACUUM_PERMITTIVITY)


def skin_conductivity(freq_hz: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Effective conductivity −ωε_0 Im ε of dry skin [S/m], of the shape of `freq_hz`."""
    omega = 2.0 * np.pi * np.asarray(freq_hz, dtype=np.float64)
    return -omega * VACUUM_PERMITTIVITY * skin_permittivity(freq_hz).imag


def normal_reflection(
    permittivity: Complex128[np.ndarray, "*shape"],
) -> Complex128[np.ndarray, "*shape"]:
    """Reflection coefficient of the electric field on a half-space at normal incidence.

    Γ = (1 − √ε) / (1 + √ε); −1 for a perfect conductor.
    """
    root = np.sqrt(np.asarray(permittivity, dtype=np.complex128))
    return (1.0 - root) / (1.0 + root)
