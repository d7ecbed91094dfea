# SPDX-License-Identifier: Apache-2.0
"""Back-projection of a synthetic aperture against the closed form of a point reflector."""

from __future__ import annotations

import numpy as np
from antennas import one_device

from rfgs_core.encode.matched_filter import aperture_filter, matched_filter
from rfgs_core.radio import frame_samples, place_devices, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.0, 2.7]])


def circle() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of the preset's transmitter and receiver [m], and its subcarriers [Hz]."""
    radio = preset("sar")
    samples = frame_samples(radio, 10.0, place_devices(radio, BOUNDS_M))
    assert samples.tx_xyz is not None and samples.rx_xyz is not None
    return samples.tx_xyz[:, 0], samples.rx_xyz[:, 0], radio.freq_hz


def echo(tx_xyz: np.ndarray, rx_xyz: np.ndarray, freq_hz: np.ndarray, at: tuple) -> np.ndarray:
    """exp(−j k (d_t + d_r)) at every place and subcarrier."""
    path_m = np.linalg.norm(tx_xyz - at, axis=1) + np.linalg.norm(rx_xyz - at, axis=1)
    return np.exp(-2j * np.pi * freq_hz / SPEED_OF_LIGHT * path_m[:, None]).astype(np.complex64)


def test_a_point_is_focused_where_it_is_in_all_three_directions() -> None:
    tx_xyz, rx_xyz, freq_hz = circle()
    at = (2.9, 1.7, 1.1)
    value = echo(tx_xyz, rx_xyz, freq_hz, at)
    offsets = np.arange(-12, 13) * 0.01
    for axis in range(3):
        line = np.tile(np.array(at), (len(offsets), 1))
        line[:, axis] += offsets
        level = np.abs(aperture_filter(value, tx_xyz, rx_xyz, freq_hz, line))
        assert np.argmax(level) == 12
        # Everything adds in phase there, give or take the reading between profile samples.
        assert 0.99 < level[12] < 1.01
        # Across the circle λ/4 is half a cell of this line, so a few centimetres away less than
        # a third is left; upwards the aperture sees from one side, and resolves by range.
        assert level[[6, 18]].max() < (0.35 if axis < 2 else 0.6)


def test_it_is_the_matched_filter_of_so_many_devices() -> None:
    tx_xyz, rx_xyz, freq_hz = (part[::30] for part in circle())
    rng = np.random.default_rng(0)
    value = echo(tx_xyz, rx_xyz, freq_hz, (2.0, 2.0, 1.0))
    points = rng.uniform(BOUNDS_M[0], BOUNDS_M[1], (40, 3))
    every = np.zeros((len(value), len(value), len(freq_hz)), np.complex64)
    every[np.arange(len(value)), np.arange(len(value))] = value
    pair = np.where(np.eye(len(value), dtype=bool), 0, -1)
    expected = matched_filter(every, one_device(tx_xyz, rx_xyz), pair, freq_hz, points)[0, 0]
    got = aperture_filter(value, tx_xyz, rx_xyz, freq_hz, points)
    assert np.allclose(got, expected, atol=1e-6)
