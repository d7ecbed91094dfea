# SPDX-License-Identifier: Apache-2.0
"""Delay profiles of a single path, under every window."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rfgs_core.radio.delay import (
    band_window,
    delay_profile,
    delay_transform,
    hann,
    hann_between,
    hann_to_zero,
)


@pytest.mark.parametrize("window", [hann, hann_to_zero, hann_between])
def test_one_path_peaks_at_its_delay_with_its_amplitude(window: Callable) -> None:
    weight = window(64)
    csi = 0.5 * np.exp(-2j * np.pi * np.arange(64) * 10.25 / 64)[None]
    profile = np.abs(delay_profile(csi, weight / weight.sum(), 4, peak=True))
    assert profile.shape == (1, 256)
    assert profile[0].argmax() == 41
    assert profile[0, 41] == pytest.approx(0.5)
    mean = np.abs(delay_profile(csi, weight, 4))
    assert mean[0, 41] == pytest.approx(0.5 * weight.sum() / 256)


def test_hidden_subcarriers_have_no_weight() -> None:
    subcarriers = np.ones(16, bool)
    subcarriers[5:8] = False
    window = band_window(subcarriers)
    assert window.sum() == pytest.approx(1.0)
    assert (window[~subcarriers] == 0).all() and (window[subcarriers] > 0).all()


def test_places_on_the_grid_are_the_plain_sum() -> None:
    """Σ H_k e^{j2π k m / size} / size of subcarriers with gaps, below and above the reference."""
    rng = np.random.default_rng(3)
    place = np.array([-5, -4, -1, 0, 2, 3])
    values = rng.standard_normal((2, 6)) + 1j * rng.standard_normal((2, 6))
    got = delay_transform(values, 24, place)
    turn = np.exp(2j * np.pi * np.outer(place, np.arange(24)) / 24)
    np.testing.assert_allclose(got, values @ turn / 24, atol=1e-12)
    counted = delay_transform(values, 24)
    np.testing.assert_allclose(counted, delay_transform(values, 24, np.arange(6)), atol=1e-15)
