# SPDX-License-Identifier: Apache-2.0
"""Preprocessing against closed forms: power, windows, and phases over gaps."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.encode.preprocess import bulk_slope, hamming, normalise_subcarriers, unwrap_phase

SPACING_HZ = 312.5e3
GRID_HZ = 5.5e9 + SPACING_HZ * np.arange(64)


def test_subcarriers_get_power_one_and_keep_their_scale() -> None:
    rng = np.random.default_rng(0)
    csi = rng.standard_normal((3, 5, 8)) + 1j * rng.standard_normal((3, 5, 8))
    csi *= 10.0 ** np.arange(-4, 4)
    csi[..., 2] = 0.0
    links = rng.random((3, 5)) < 0.7
    normal, scale = normalise_subcarriers(csi, links)
    power = np.mean(np.abs(normal[links]) ** 2, axis=0)
    np.testing.assert_allclose(np.delete(power, 2), 1.0)
    assert (normal[..., 2] == 0).all()
    assert scale[2] == 0.0
    assert (normal[~links] == 0).all()
    np.testing.assert_allclose(normal[links] * scale, csi[links], rtol=1e-12)


def test_silence_stays_silence() -> None:
    normal, scale = normalise_subcarriers(np.zeros((1, 2, 4), complex), np.ones((1, 2), bool))
    assert (normal == 0).all()
    assert (scale == 0).all()


def test_hamming_is_numpys_on_a_full_grid() -> None:
    width_hz = GRID_HZ[-1] - GRID_HZ[0]
    window = hamming(GRID_HZ, GRID_HZ.mean(), width_hz)
    np.testing.assert_allclose(window, np.hamming(64), atol=1e-9)
    # Subcarriers next to a gap keep their place.
    kept = np.r_[0:20, 30:64]
    np.testing.assert_array_equal(hamming(GRID_HZ[kept], GRID_HZ.mean(), width_hz), window[kept])
    assert (hamming(GRID_HZ, GRID_HZ[10], 4 * SPACING_HZ)[[7, 13]] == 0).all()


def test_hamming_pushes_side_lobes_below_40_db() -> None:
    """−42.7 dB is the highest side lobe of this window, −13.3 dB that without one."""
    width_hz = GRID_HZ[-1] - GRID_HZ[0]
    for window, level_db in ((hamming(GRID_HZ, GRID_HZ.mean(), width_hz), -42.0), (1.0, -13.2)):
        profile = np.abs(np.fft.fft(window * np.ones(64), 64 * 64))
        beyond = profile[3 * 64 : -3 * 64] if level_db < -40 else profile[64:-64]
        assert 20 * np.log10(beyond.max() / profile[0]) == pytest.approx(level_db, abs=1.0)


@pytest.mark.parametrize("length_m", [0.0, 3.0, 40.0, 300.0])
@pytest.mark.parametrize("gaps", ["none", "dc", "sub-bands"])
def test_one_paths_phase_is_a_line_over_any_gap(length_m: float, gaps: str) -> None:
    """−2πfτ, up to one whole number of turns for all subcarriers."""
    kept = {"none": np.r_[0:64], "dc": np.r_[0:31, 34:64], "sub-bands": np.r_[0:12, 50:64]}[gaps]
    freq_hz, delay_s = GRID_HZ[kept], length_m / 299792458.0
    true = -2 * np.pi * freq_hz * delay_s
    phase, slope = unwrap_phase(np.exp(1j * true), freq_hz)
    turns = (phase - true) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-6)
    assert slope == pytest.approx(-2 * np.pi * delay_s, abs=1e-13)
    if gaps == "sub-bands" and length_m == 300.0:
        # Subcarrier by subcarrier the same phases come out wrong.
        naive = (np.unwrap(np.angle(np.exp(1j * true))) - true) / (2 * np.pi)
        assert np.ptp(np.round(naive)) >= 1


def test_links_unwrap_on_their_own_and_echoes_stay() -> None:
    """A weak echo bends the line; phases still agree with the channel's."""
    delays_s = np.array([[10e-9, 60e-9], [200e-9, 290e-9]])
    kept = np.r_[0:25, 40:64]
    freq_hz = GRID_HZ[kept]
    waves = np.exp(-2j * np.pi * freq_hz * delays_s[..., None])
    csi = waves[:, 0] + 0.4 * waves[:, 1]
    phase, slope = unwrap_phase(csi, freq_hz)
    np.testing.assert_allclose(np.exp(1j * phase), csi / np.abs(csi), atol=1e-9)
    steps = np.abs(np.diff(phase - slope[:, None] * (freq_hz - freq_hz[0]), axis=1))
    assert steps.max() < np.pi
    # The mean delay lies between the two, nearer to the stronger.
    mean_s = -bulk_slope(csi, freq_hz) / (2 * np.pi)
    assert (mean_s > delays_s[:, 0] - 5e-9).all()
    assert (mean_s < delays_s.mean(axis=1)).all()
