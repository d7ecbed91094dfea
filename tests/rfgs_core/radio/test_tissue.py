# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.radio.tissue import normal_reflection, skin_conductivity, skin_permittivity

# GHz, relative permittivity, conductivity [S/m], as the IFAC-CNR service lists dry skin.
TABLE = [
    (2.45, 38.0, 1.46),
    (5.2, 35.6, 3.22),
    (5.8, 35.1, 3.72),
    (6.5, 34.5, 4.34),
    (28.0, 16.6, 25.8),
    (60.0, 7.98, 36.4),
    (77.0, 6.56, 38.2),
]


@pytest.mark.parametrize(("freq_ghz", "epsilon", "sigma"), TABLE)
def test_dry_skin_matches_published_table(freq_ghz: float, epsilon: float, sigma: float) -> None:
    freq_hz = np.array([freq_ghz * 1e9])
    assert skin_permittivity(freq_hz)[0].real == pytest.approx(epsilon, rel=3e-3)
    assert skin_conductivity(freq_hz)[0] == pytest.approx(sigma, rel=5e-3)


def test_skin_reflects_as_published() -> None:
    gamma = normal_reflection(skin_permittivity(np.array([5.8e9, 60e9])))
    assert np.abs(gamma) == pytest.approx([0.72, 0.62], abs=0.01)
    assert np.all(gamma.real < 0)


def test_conductor_inverts_the_field() -> None:
    assert normal_reflection(np.array([-1e12j]))[0] == pytest.approx(-1.0, abs=1e-5)
