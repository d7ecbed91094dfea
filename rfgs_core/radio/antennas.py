# SPDX-License-Identifier: Apache-2.0
"""Antenna patterns and polarisations: the field an antenna sends in a direction.

The models and names are those of Sionna RT 2.2.0, which traces the environment with them; here
they are written out in NumPy for everything that does without a ray tracer.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from rfgs_core.radio.levels import amplitude_of

_Angles = Float64[np.ndarray, "point"]
_Vectors = Float64[np.ndarray, "point 3"]

#: Slant of each port of a polarisation [°]: 0 is vertical, 90 horizontal.
POLARIZATIONS: dict[str, tuple[float, ...]] = {
    "V": (0.0,),
    "H": (90.0,),
    "VH": (0.0, 90.0),
    "cross": (-45.0, 45.0),
}


def _iso(theta: _Angles, phi: _Angles) -> _Angles:
    """Equal in all directions."""
    return np.ones_like(theta)


def _dipole(theta: _Angles, phi: _Angles) -> _Angles:
    """Short dipole, Balanis, Antenna Theory (1997), eq. 4-26a; directivity 1.5."""
    return np.sqrt(1.5) * np.abs(np.sin(theta))


def _hw_dipole(theta: _Angles, phi: _Angles) -> _Angles:
    """Half-wave dipole, Balanis (1997), eq. 4-84; directivity 1.643."""
    sine = np.sin(theta)
    along = np.abs(sine) < 1e-5
    field = np.cos(0.5 * np.pi * np.cos(theta)) / np.where(along, 1.0, sine)
    return np.sqrt(1.643) * np.abs(field)


def _tr38901(theta: _Angles, phi: _Angles) -> _Angles:
    """Base station element of 3GPP TR 38.901, table 7.3-1; 8 dBi, 65° wide."""
    width = np.deg2rad(65.0)
    phi = (phi + np.pi) % (2.0 * np.pi) - np.pi
    vertical_db = np.minimum(12.0 * ((theta - 0.5 * np.pi) / width) ** 2, 30.0)
    horizontal_db = np.minimum(12.0 * (phi / width) ** 2, 30.0)
    return amplitude_of(8.0 - np.minimum(vertical_db + horizontal_db, 30.0))


#: Magnitude of the field over zenith angle and azimuth [rad] in the antenna's own axes.
PATTERNS: dict[str, Callable[[_Angles, _Angles], _Angles]] = {
    "iso": _iso,
    "dipole": _dipole,
    "hw_dipole": _hw_dipole,
    "tr38901": _tr38901,
}


def field(
    pattern: str, slant_deg: float, directions: _Vectors, axes: Float64[np.ndarray, "3 3"]
) -> _Vectors:
    """Field that an antenna sends in some directions, or hears from them.

    The slant turns the field in its own plane, as 3GPP TR 38.901's second model (eq. 7.3-4/5):
    the pattern stays and C_θ, C_φ become cos ζ and sin ζ of it.

    Args:
        pattern: One of `PATTERNS`.
        slant_deg: Slant ζ of the polarisation [°].
        directions: World vectors away from the antenna, of any length.
        axes: Rotation world_from_device.

    Returns:
        World vectors, transverse to the directions; of length 1 for an isotropic antenna.
    """
    local = directions @ axes
    theta, phi = spherical_basis(local)
    length = np.maximum(np.linalg.norm(local, axis=1), 1e-12)
    zenith = np.arccos(np.clip(local[:, 2] / length, -1.0, 1.0))
    strength = PATTERNS[pattern](zenith, np.arctan2(local[:, 1], local[:, 0]))
    slant = np.deg2rad(slant_deg)
    # Multiples of 45° exactly: an upright antenna has no trace of the other component.
    along, across = (round(float(part), 15) for part in (np.cos(slant), np.sin(slant)))
    return (strength[:, None] * (along * theta + across * phi)) @ axes.T


def passed_on(into: _Vectors, out_of: _Vectors, sent: _Vectors, heard: _Vectors) -> _Angles:
    """Field heard by way of points that keep polarisation.

    A point hands the θ and φ components of the field on unchanged, as Sionna's scattering
    points do.

    Args:
        into: Vectors from the transmitter to the points.
        out_of: Vectors from the points to the receiver.
        sent: Field of the transmitter along `into`, see `field`.
        heard: Field of the receiver along minus `out_of`.

    Returns:
        Factor of each point's amplitude, shape (point,).
    """
    theta_i, phi_i = spherical_basis(into)
    theta_s, phi_s = spherical_basis(out_of)
    along = np.sum(sent * theta_i, axis=1) * np.sum(heard * theta_s, axis=1)
    return along + np.sum(sent * phi_i, axis=1) * np.sum(heard * phi_s, axis=1)


def spherical_basis(directions: _Vectors) -> tuple[_Vectors, _Vectors]:
    """Unit vectors θ̂ and φ̂ of directions of any length, each of shape (point, 3).

    Straight up and straight down the azimuth is 0, as in Sionna RT.
    """
    x, y, z = directions.T
    length = np.maximum(np.linalg.norm(directions, axis=1), 1e-12)
    vertical = np.hypot(x, y) < 1e-7 * length
    azimuth = np.where(vertical, 0.0, np.arctan2(y, x))
    cos_theta = np.clip(z / length, -1.0, 1.0)
    sin_theta = np.sqrt(1.0 - cos_theta**2)
    theta = np.stack([cos_theta * np.cos(azimuth), cos_theta * np.sin(azimuth), -sin_theta], axis=1)
    phi = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    return theta, phi
