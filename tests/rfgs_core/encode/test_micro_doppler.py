# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.encode.micro_doppler import micro_doppler
from rfgs_core.errors import RfgsError
from rfgs_core.radio import preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def echo(time_s: np.ndarray, velocity: float, amplitude: float, freq_hz: np.ndarray) -> np.ndarray:
    """Out-and-back echo of a point that approaches from 3 m, shape (time, subcarrier)."""
    path = 2.0 * (3.0 - velocity * time_s)
    return amplitude * np.exp(-2j * np.pi * path[:, None] * freq_hz / SPEED_OF_LIGHT)


def test_two_speeds_peak_where_they_are_with_their_power() -> None:
    # 26 % bandwidth: at one wavelength for all subcarriers the faster line would be 1 m/s wide.
    freq_hz, time_s = np.linspace(5.0e9, 6.5e9, 12), np.arange(400) * 1e-3
    links = [echo(time_s, 1.2, 1.0, freq_hz), echo(time_s, 1.2, 1.0, freq_hz) * 1j]
    slow = np.stack(links, axis=1)
    both = slow + echo(time_s, -4.0, 0.3, freq_hz)[:, None]
    found = micro_doppler(both, time_s, freq_hz)
    column = found.power[:, 3]
    near = np.abs(found.velocity_m_s + 4.0) < 0.5
    assert found.velocity_m_s[column.argmax()] == pytest.approx(1.2, abs=0.07)
    assert found.velocity_m_s[near][column[near].argmax()] == pytest.approx(-4.0, abs=0.07)
    assert column.max() == pytest.approx(1.0, rel=0.05)
    assert column[near].max() == pytest.approx(0.09, rel=0.1)
    assert found.power.shape == (len(found.velocity_m_s), len(found.time_s))
    assert np.allclose(found.time_s[:2], [0.5 * 199e-3, 0.5 * 199e-3 + 0.05])


def test_windows_stay_within_bursts_of_chirps() -> None:
    freq_hz = preset("mmwave").freq_hz[::40]
    time_s = (np.arange(3)[:, None] * 0.1 + np.arange(64) * 0.25e-3).ravel()
    found = micro_doppler(echo(time_s, 2.5, 1.0, freq_hz), time_s, freq_hz)
    assert np.allclose(found.time_s, np.arange(3) * 0.1 + 0.5 * 63 * 0.25e-3)
    assert np.allclose(found.velocity_m_s[found.power.argmax(axis=0)], 2.5, atol=0.08)
    # The largest speed that 4 kHz tells apart at the lowest subcarrier.
    assert found.velocity_m_s.max() == pytest.approx(SPEED_OF_LIGHT / freq_hz[0] * 1e3)


def test_limit_cuts_the_axis_and_single_samples_are_refused() -> None:
    freq_hz, time_s = np.array([5.8e9]), np.arange(100) * 2e-3
    found = micro_doppler(echo(time_s, 0.5, 1.0, freq_hz), time_s, freq_hz, velocity_limit_m_s=2.0)
    assert found.velocity_m_s[[0, -1]].tolist() == [-2.0, 2.0]
    with pytest.raises(RfgsError, match="packets-per-frame"):
        micro_doppler(np.ones((3, 1), complex), np.arange(3) * 0.1, freq_hz)
