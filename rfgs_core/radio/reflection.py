# SPDX-License-Identifier: Apache-2.0
"""How strongly the radio materials reflect: permittivities and the slab formula."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex128, Float

from rfgs_core.radio.constants import SPEED_OF_LIGHT, VACUUM_PERMITTIVITY
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.tissue import normal_reflection, skin_permittivity

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


def slab_reflection(
    name: str, freq_hz: Float[np.ndarray, "*shape"]
) -> Complex128[np.ndarray, "*shape"]:
    """Reflection of a slab of a material's usual thickness d at normal incidence.

    R = Γ (1 − e^{−j2q}) / (1 − Γ² e^{−j2q}), q = 2πd√ε/λ (ITU-R P.2040-4, section 2.2.2.2).

    Args:
        name: One of `materials.MATERIALS`, which tells the thickness.
        freq_hz: Frequencies within the material's validity [Hz].
    """
    permittivity = material_permittivity(name, freq_hz)
    surface = normal_reflection(permittivity)
    wavenumber = 2 * np.pi * np.asarray(freq_hz, dtype=np.float64) / SPEED_OF_LIGHT
    # √ε of a lossy material has a negative imaginary part: the wave fades on its way.
    turn = np.exp(-2j * wavenumber * MATERIALS[name].thickness_m * np.sqrt(permittivity))
    return surface * (1 - turn) / (1 - surface**2 * turn)
