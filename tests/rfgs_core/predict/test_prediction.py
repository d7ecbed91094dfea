# SPDX-License-Identifier: Apache-2.0
"""Channels at new positions: the radar equation, directions, and agreement with the run."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.measure.observations import observe
from rfgs_core.model.channel import Channel
from rfgs_core.predict.antennas import receiving_array
from rfgs_core.predict.echoes import echoes_at, reflectors
from rfgs_core.predict.prediction import predict_channel
from rfgs_core.predict.spectra import (
    arrival_power,
    beam_power,
    profile_over_delay,
    sky_cells,
)
from rfgs_core.radio import preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.run import Run

FREQ_HZ = preset("wifi").freq_hz
TX = np.array([0.0, 0.0, 1.0])
RX = np.array([[4.0, 0.5, 1.2], [1.0, -2.0, 0.8]])
POINT = [2.0, 3.0, 1.5]
CENTRE_HZ = float(FREQ_HZ.mean())


def test_one_gaussian_gives_the_radar_equation(make_points) -> None:
    gamma = 0.3 * np.exp(1.1j)
    prediction = predict_channel(make_points([POINT], [gamma]), TX, RX[:, None], FREQ_HZ)
    out, back = np.linalg.norm(POINT - TX), np.linalg.norm(POINT - RX, axis=1)
    wavelength = SPEED_OF_LIGHT / FREQ_HZ
    # P_r / P_t = σ λ² / ((4π)³ d_t² d_r²), σ = |γ|².
    power = abs(gamma) ** 2 * wavelength**2 / ((4 * np.pi) ** 3 * (out * back[:, None]) ** 2)
    np.testing.assert_allclose(np.abs(prediction.csi_scatter[:, 0]) ** 2, power, rtol=1e-3)
    phase = np.angle(gamma) - 2 * np.pi * FREQ_HZ * (out + back[:, None]) / SPEED_OF_LIGHT
    turned = prediction.csi_scatter[:, 0] * np.exp(-1j * phase)
    np.testing.assert_allclose(np.angle(turned), 0, atol=2e-3)


def test_its_delay_profile_peaks_at_its_delay_with_its_amplitude(make_points) -> None:
    prediction = predict_channel(make_points([POINT], [0.3]), TX, RX[:, None], FREQ_HZ)
    profile, delay_s = profile_over_delay(prediction.csi_scatter[:, 0], FREQ_HZ)
    length_m = np.linalg.norm(POINT - TX) + np.linalg.norm(POINT - RX, axis=1)
    peak = profile.argmax(axis=1)
    step_s = delay_s[1]
    np.testing.assert_allclose(delay_s[peak], length_m / SPEED_OF_LIGHT, atol=0.51 * step_s)
    expected = np.abs(prediction.csi_scatter[:, 0]).mean(axis=1)
    np.testing.assert_allclose(profile.max(axis=1), expected, rtol=0.012)


def test_the_straight_way_is_friis_until_somebody_stands_on_it(make_points) -> None:
    beside = predict_channel(
        make_points([POINT], [0.3], alpha=0.9, scale_m=0.05), TX, RX[:, None], FREQ_HZ
    )
    length = np.linalg.norm(RX - TX, axis=1)[:, None]
    wavelength = SPEED_OF_LIGHT / FREQ_HZ
    expected = wavelength / (4 * np.pi * length) * np.exp(-2j * np.pi * length / wavelength)
    np.testing.assert_allclose(beside.csi_direct[:, 0], expected, rtol=2e-4)
    middle = list(0.5 * (TX + RX[0]))
    between = predict_channel(
        make_points([middle], [0.0], alpha=0.9, scale_m=0.3), TX, RX[:, None], FREQ_HZ
    )
    assert abs(between.passed[0, 0]) < 0.3
    assert abs(between.passed[1, 0]) == pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(between.csi, between.csi_direct)


def test_the_spectrum_points_at_the_gaussian(make_points) -> None:
    gaussians = make_points([POINT, [3.0, 3.0, 0.5]], [0.3, 0.01])
    power = arrival_power(echoes_at(gaussians, TX, RX, FREQ_HZ))
    elevation, azimuth = sky_cells()
    for spectrum, place in zip(power, RX, strict=True):
        row, column = np.unravel_index(spectrum.argmax(), spectrum.shape)
        leg = np.array(POINT) - place
        assert azimuth[column] == pytest.approx(np.rad2deg(np.arctan2(leg[1], leg[0])), abs=1.01)
        up = np.rad2deg(np.arcsin(leg[2] / np.linalg.norm(leg)))
        assert elevation[row] == pytest.approx(up, abs=1.01)


def test_the_beams_of_an_array_point_at_the_gaussian(make_points) -> None:
    elements, yaw = receiving_array(preset("wifi"), RX[0], np.array([2.0, 2.0, 0.0]))
    assert elements.shape == (64, 3)
    np.testing.assert_allclose(elements.mean(axis=0), RX[0], atol=1e-12)
    # Upright, and across the boresight.
    across = elements - RX[0]
    np.testing.assert_allclose(across @ [np.cos(yaw), np.sin(yaw), 0], 0, atol=1e-12)
    prediction = predict_channel(make_points([POINT], [0.3]), TX, elements[None], FREQ_HZ)
    power = beam_power(prediction.csi_scatter[0], elements, FREQ_HZ, yaw)
    elevation, azimuth = sky_cells()
    row, column = np.unravel_index(int(np.nanargmax(power)), power.shape)
    leg = np.array(POINT) - RX[0]
    assert azimuth[column] == pytest.approx(np.rad2deg(np.arctan2(leg[1], leg[0])), abs=2)
    assert elevation[row] == pytest.approx(np.rad2deg(np.arcsin(leg[2] / 3.2)), abs=2)
    amplitude = np.abs(prediction.csi_scatter).mean()
    assert np.nanmax(power) == pytest.approx(amplitude**2, rel=0.02)
    behind = np.cos(np.deg2rad(azimuth) - yaw) < 0
    assert np.isnan(power[:, behind]).all() and np.isfinite(power[:, ~behind]).all()


def test_echoes_add_up_to_the_channel(make_points) -> None:
    gaussians = make_points([POINT, [3.0, 3.0, 0.5]], [[0.3, 0.1j, 0.2], [0.1, 0.2, 0.3]])
    echoes = echoes_at(gaussians, TX, RX, FREQ_HZ)
    power = arrival_power(echoes)
    np.testing.assert_allclose(power.sum(axis=(1, 2)), echoes.power.sum(axis=1))
    for index in range(2):
        rows = {"means", "quats", "scales", "scales_rf", "gamma", "alpha"}
        alone = type(gaussians)(
            **{name: getattr(gaussians, name)[index : index + 1] for name in rows}
        )
        csi = predict_channel(alone, TX, RX[:, None], np.linspace(*FREQ_HZ[[0, -1]], 5))
        expected = (np.abs(csi.csi_scatter[:, 0]) ** 2).mean(axis=1)
        np.testing.assert_allclose(echoes.power[:, index], expected, rtol=1e-4)
    length = np.linalg.norm(POINT - TX) + np.linalg.norm(POINT - RX, axis=1)
    np.testing.assert_allclose(echoes.delay_s[:, 0], length / SPEED_OF_LIGHT)


def test_reflectors_tell_power_phase_and_slope(make_points) -> None:
    knots = np.linspace(FREQ_HZ[0], FREQ_HZ[-1], 4) / CENTRE_HZ
    gaussians = make_points([POINT, [2.0, -1.0, 1.8]], np.stack([0.2j * knots, 0.1 + 0 * knots]))
    own = reflectors(gaussians, FREQ_HZ)
    np.testing.assert_allclose(own.slope, [2.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(own.phase_rad, [np.pi / 2, 0], atol=1e-6)
    np.testing.assert_allclose(own.rcs_m2, [0.04, 0.01], rtol=1e-3)
    narrow = reflectors(make_points([POINT], [0.2]), FREQ_HZ)
    assert np.isnan(narrow.slope).all()


def test_at_recorded_antennas_it_is_the_runs_own_scattering(small_run: Run) -> None:
    seen = observe(small_run.sequence, "wifi", 2)
    channel = Channel.of(seen, seen.layout.measured, np.ones(16, bool))
    with torch.no_grad():
        own = channel.scattered(small_run.head, small_run.moving(2)).numpy()
    gaussians = small_run.head.radio_gaussians(small_run.moving(2))
    for tx in np.unique(channel.tx):
        rows = channel.tx == tx
        places = seen.layout.rx_xyz[channel.rx[rows]]
        prediction = predict_channel(
            gaussians, seen.layout.tx_xyz[tx], places[:, None], seen.freq_hz
        )
        np.testing.assert_allclose(prediction.csi_scatter[:, 0], own[rows], rtol=1e-3, atol=1e-9)
