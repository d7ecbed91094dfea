# SPDX-License-Identifier: Apache-2.0
"""Closed forms of propagation in plain NumPy, written apart from what they judge.

Time goes as e^{+jωt}, so that a path of length d turns the phase by e^{−jkd}. A channel is the
voltage ratio of isotropic antennas: free space has |H| = λ/(4πd).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import fresnel

from rfgs_core.radio.levels import amplitude_decibels, decibels

#: Speed of light [m/s], exact by definition of the metre.
C = 299_792_458.0


def friis(freq_hz: np.ndarray, distance_m: np.ndarray | float) -> np.ndarray:
    """Free-space channel H = λ/(4πd) e^{−j2πd/λ} (Friis 1946, isotropic antennas).

    Args:
        freq_hz: Frequencies [Hz], shape (f,).
        distance_m: Distances [m], shape (...).

    Returns:
        Complex128, shape (..., f).
    """
    wavelength = C / np.asarray(freq_hz, dtype=np.float64)
    d = np.asarray(distance_m, dtype=np.float64)[..., None]
    return wavelength / (4.0 * np.pi * d) * np.exp(-2j * np.pi * d / wavelength)


def fresnel_integral(nu: np.ndarray | float) -> np.ndarray:
    """F(ν) = ∫_0^ν e^{−jπt²/2} dt (Abramowitz and Stegun, 7.3)."""
    sine, cosine = fresnel(nu)
    return cosine - 1j * sine


def db(ratio: np.ndarray | complex | float) -> np.ndarray:
    """20 log10 of an amplitude [dB]."""
    return amplitude_decibels(np.abs(ratio), least=1e-300)


def error_db(found: np.ndarray, exact: np.ndarray) -> float:
    """Power of the error over the power of the exact channel [dB]."""
    error = np.sum(np.abs(found - exact) ** 2) / np.sum(np.abs(exact) ** 2)
    return float(decibels(float(error)))


def sphere_path_m(tx: np.ndarray, rx: np.ndarray, centre: np.ndarray, radius_m: float) -> float:
    """Length of the way from one place to another by the surface of a sphere [m] (Fermat).

    The point of reflection lies in the plane of both places and the centre, where the way is
    shortest.

    Args:
        tx: One place [m], shape (3,).
        rx: The other [m], shape (3,).
        centre: Centre of the sphere [m], shape (3,).
        radius_m: Its radius [m].
    """
    a, b = tx - centre, rx - centre
    u = a / np.linalg.norm(a)
    across = b - (b @ u) * u
    size = np.linalg.norm(across)
    v = across / size if size > 1e-9 else np.zeros(3)
    opening = float(np.arctan2(b @ v, b @ u))

    def length(angle: float) -> float:
        point = radius_m * (np.cos(angle) * u + np.sin(angle) * v)
        return float(np.linalg.norm(a - point) + np.linalg.norm(b - point))

    bounds = (min(0.0, opening) - 1e-9, max(0.0, opening) + 1e-9)
    found: Any = minimize_scalar(length, bounds=bounds, method="bounded")
    return float(found.fun)
