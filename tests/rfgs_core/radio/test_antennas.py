# SPDX-License-Identifier: Apache-2.0
"""Antenna patterns hold the power and the directions their sources state."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.radio.antennas import PATTERNS, POLARIZATIONS, field, passed_on
from rfgs_core.radio.layout import rotation

TILTED = rotation((0.8, 0.3, -0.4, 0.33))


def sphere() -> tuple[np.ndarray, np.ndarray]:
    """Directions over the sphere and the solid angle each stands for."""
    theta = (np.arange(400) + 0.5) * np.pi / 400
    phi = (np.arange(800) + 0.5) * np.pi / 400 - np.pi
    t, p = (part.ravel() for part in np.meshgrid(theta, phi, indexing="ij"))
    directions = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    return directions, np.sin(t) * (np.pi / 400) ** 2


@pytest.mark.parametrize(("pattern", "peak"), [("iso", 1.0), ("dipole", 1.5), ("hw_dipole", 1.643)])
@pytest.mark.parametrize("slant_deg", [0.0, 90.0, 45.0])
def test_lossless_antennas_radiate_all_their_power(
    pattern: str, peak: float, slant_deg: float
) -> None:
    directions, solid_angle = sphere()
    power = (field(pattern, slant_deg, directions, TILTED) ** 2).sum(axis=1)
    assert power.max() == pytest.approx(peak, rel=1e-3)
    # Balanis rounds the half-wave dipole's directivity (1.6409) to 1.643.
    assert (power * solid_angle).sum() / (4 * np.pi) == pytest.approx(1.0, rel=2e-3)


def test_the_base_station_element_has_the_standard_gain_and_widths() -> None:
    # 8 dBi ahead, −3 dB at ±32.5°, 30 dB below the peak behind: TR 38.901, table 7.3-1.
    angle = np.deg2rad([0.0, 32.5, 180.0])
    ahead = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
    power_db = 20 * np.log10(np.linalg.norm(field("tr38901", 0.0, ahead, np.eye(3)), axis=1))
    np.testing.assert_allclose(power_db, [8.0, 5.0, -22.0], atol=1e-9)
    up = np.stack([np.cos(angle), np.zeros(3), np.sin(angle)], axis=1)[:2]
    power_db = 20 * np.log10(np.linalg.norm(field("tr38901", 0.0, up, np.eye(3)), axis=1))
    np.testing.assert_allclose(power_db, [8.0, 5.0], atol=1e-9)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_fields_are_transverse_and_ports_orthogonal(pattern: str) -> None:
    directions = np.random.default_rng(0).normal(size=(50, 3))
    for name in ("VH", "cross"):
        first, second = (field(pattern, slant, directions, TILTED) for slant in POLARIZATIONS[name])
        for sent in (first, second):
            np.testing.assert_allclose((sent * directions).sum(axis=1), 0.0, atol=1e-12)
        np.testing.assert_allclose((first * second).sum(axis=1), 0.0, atol=1e-12)


def test_upright_antennas_of_one_polarisation_pass_everything_on() -> None:
    random = np.random.default_rng(1)
    into, out_of = random.normal(size=(2, 40, 3))
    vertical = [field("iso", 0.0, way, np.eye(3)) for way in (into, -out_of)]
    across = [field("iso", 90.0, way, np.eye(3)) for way in (into, -out_of)]
    np.testing.assert_allclose(passed_on(into, out_of, *vertical), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(passed_on(into, out_of, *across)), 1.0, atol=1e-12)
    mixed = passed_on(into, out_of, vertical[0], across[1])
    np.testing.assert_allclose(mixed, 0.0, atol=1e-12)
