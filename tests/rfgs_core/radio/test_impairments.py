# SPDX-License-Identifier: Apache-2.0
"""Each impairment follows its closed form, and taking it back restores the clean channel."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio, layout, place_devices
from rfgs_core.radio.impairments import (
    IMPAIRMENT_PRESETS,
    Draw,
    Impairments,
    draw_impairments,
    impair,
    read_impairments,
    restore,
)
from rfgs_core.radio.impairments.receiver import noise_variance, quantise

RADIO = Radio(
    name="test",
    freq_min_hz=5.72e9,
    freq_max_hz=5.88e9,
    num_subcarriers=32,
    tx_rows=1,
    tx_cols=2,
    rx_rows=2,
    rx_cols=3,
    tx_offset_m=(0.0, 0.0, -0.3),
    num_devices=3,
)
BOUNDS_M = np.array([[0.0, 0.0, 0.0], [4.0, 5.0, 2.5]])
LAYOUT = layout(RADIO, place_devices(RADIO, BOUNDS_M))
COUNT = 60
TIME_S = np.arange(COUNT) * 0.01
ALL = slice(0, COUNT)
#: Pairs of elements whose devices differ.
APART = LAYOUT.tx_device[:, None] != LAYOUT.rx_device[None, :]


def clean() -> np.ndarray:
    """Channels of the size that rooms have, different at every entry."""
    random = np.random.default_rng(5)
    shape = (COUNT, *LAYOUT.measured.shape, RADIO.num_subcarriers)
    value = random.standard_normal(shape) + 1j * random.standard_normal(shape)
    return (1e-3 * value).astype(np.complex64)


def run(settings: Impairments, seed: int = 0) -> tuple[np.ndarray, np.ndarray, Draw]:
    drawn = draw_impairments(settings, LAYOUT, TIME_S, seed, "scene", "test")
    random = np.random.default_rng(seed)
    value, gain_db = impair(clean(), settings, drawn, RADIO, LAYOUT, ALL, random)
    return value, gain_db, drawn


def turned(settings: Impairments) -> tuple[np.ndarray, Draw]:
    """Phase that impairments added, and their draw."""
    value, _, drawn = run(settings)
    return np.angle(value / clean()), drawn


def wrapped(phase: np.ndarray) -> np.ndarray:
    return np.angle(np.exp(1j * phase))


def restored(settings: Impairments) -> np.ndarray:
    value, gain_db, drawn = run(settings)
    return restore(value, drawn, RADIO, LAYOUT, ALL, gain_db)


def test_nothing_asked_changes_nothing() -> None:
    assert np.array_equal(run(Impairments())[0], clean())


def test_carrier_offset_is_a_phase_ramp_in_time() -> None:
    phase, drawn = turned(Impairments(cfo_std_hz=20.0))
    offset_hz = drawn.cfo_hz[LAYOUT.tx_device][:, None] - drawn.cfo_hz[LAYOUT.rx_device][None]
    expected = 2 * np.pi * offset_hz * TIME_S[:, None, None]
    assert np.abs(wrapped(phase - expected[..., None])).max() < 1e-4
    slope_hz = np.unwrap(phase[:, 0, -1, 7])
    assert np.isclose(np.polyfit(TIME_S, slope_hz, 1)[0], 2 * np.pi * offset_hz[0, -1], rtol=1e-4)
    assert np.abs(phase[:, ~APART]).max() < 1e-4


def test_timing_offset_is_a_slope_over_subcarriers() -> None:
    phase, drawn = turned(Impairments(sto_std_s=3e-9))
    late_s = drawn.sto_s[:, LAYOUT.tx_device][:, :, None] - drawn.sto_s[:, None, LAYOUT.rx_device]
    subcarriers = RADIO.freq_hz - RADIO.centre_hz
    assert np.abs(wrapped(phase + 2 * np.pi * late_s[..., None] * subcarriers)).max() < 1e-4
    assert 2e-9 < drawn.sto_s.std() < 4e-9
    # A late transmitter looks like a longer path: the delay the slope stands for agrees.
    slope = np.polyfit(subcarriers, np.unwrap(phase[3, 0, -1]), 1)[0]
    assert np.isclose(-slope / (2 * np.pi), late_s[3, 0, -1], rtol=1e-3)


def test_sampling_offset_is_a_slope_that_grows_with_time() -> None:
    phase, drawn = turned(Impairments(sfo_std_ppm=0.02))
    subcarriers = RADIO.freq_hz - RADIO.centre_hz
    slopes = np.polyfit(subcarriers, np.unwrap(phase[:, 0, -1], axis=-1).T, 1)[0]
    growth = np.polyfit(TIME_S, slopes, 1)[0]
    apart = 1e-6 * (drawn.sfo_ppm[0] - drawn.sfo_ppm[-1])
    assert np.isclose(growth, -2 * np.pi * apart, rtol=1e-3)
    assert np.allclose(slopes, growth * TIME_S, atol=1e-4 * abs(growth * TIME_S[-1]))
    # A clock that falls behind by s ppm shows 1 - s millionths of the time that passed.
    rate = drawn.timestamp_s[-1] / TIME_S[-1]
    assert np.allclose(rate, 1 - 1e-6 * drawn.sfo_ppm, atol=1e-12)


def test_phase_noise_is_a_locked_loop_of_the_asked_jitter() -> None:
    bandwidth_hz, rms_deg, step_s = 40.0, 3.0, 1e-3
    settings = Impairments(phase_noise_rms_deg=rms_deg, phase_noise_bandwidth_hz=bandwidth_hz)
    times_s = np.arange(40_000) * step_s
    jitter = draw_impairments(settings, LAYOUT, times_s, 1, "x").phase_noise_rad
    variance = np.deg2rad(rms_deg) ** 2
    for lag in (0, 1, 4):
        covariance = (jitter[lag:] * jitter[: len(jitter) - lag]).mean()
        expected = variance * np.exp(-2 * np.pi * bandwidth_hz * lag * step_s)
        # Samples are correlated over 1/(2πB) = 4 steps, three devices: 5 % is four sigma.
        assert np.isclose(covariance, expected, rtol=0.05), lag
    phase, drawn = turned(replace(settings, phase_noise_bandwidth_hz=1e5))
    link = drawn.phase_noise_rad[:, LAYOUT.tx_device][:, :, None]
    link = link - drawn.phase_noise_rad[:, None, LAYOUT.rx_device]
    assert np.abs(phase - link[..., None]).max() < 1e-4


def test_noise_power_is_ktbf_over_transmit_power() -> None:
    settings = Impairments(thermal_noise=True)
    added = run(settings)[0].astype(complex) - clean()
    by_hand = 1.380649e-23 * 290 * 160e6 * 10**0.7 / 0.1
    assert np.isclose(noise_variance(settings, RADIO), by_hand, rtol=1e-12)
    # 2 Σ|n|²/σ² is chi-square with two degrees of freedom per complex value.
    total = 2 * (np.abs(added) ** 2).sum() / by_hand
    low, high = stats.chi2.interval(0.999, 2 * added.size)
    assert low < total < high
    assert abs((added**2).mean()) < 5 * by_hand / np.sqrt(added.size)
    louder = Impairments(thermal_noise=True, noise_figure_db=10.0, power_dbm=10.0)
    more = noise_variance(louder, RADIO) / noise_variance(settings, RADIO)
    assert np.isclose(more, 10**1.3)
    assert np.isclose(noise_variance(replace(settings, training_symbols=4), RADIO), by_hand / 4)


def test_quantisation_error_is_a_twelfth_of_a_step_squared() -> None:
    for bits in (6, 10):
        settings = Impairments(agc=True, adc_bits=bits)
        value, gain_db, drawn = run(settings)
        unquantised, _, _ = run(Impairments(agc=True))
        error = value.astype(complex) - unquantised
        step = 2.0 ** (1 - bits)
        assert np.isclose((error.real**2).mean(), step**2 / 12, rtol=0.02)
        assert np.isclose((error.imag**2).mean(), step**2 / 12, rtol=0.02)
        assert np.abs(error.real).max() <= step / 2 * 1.001
        assert np.allclose(value.real / step, np.rint(value.real / step))
        # Taken back, what is left is half a step under each pair's gain.
        left = restore(value, drawn, RADIO, LAYOUT, ALL, gain_db) - clean()
        gain = 10 ** (gain_db[:, LAYOUT.tx_device[:, None], LAYOUT.rx_device] / 20)[..., None]
        assert (np.abs(left.real) <= step / 2 / gain * 1.001 + 1e-9).all()


def test_the_converter_clips_at_full_scale() -> None:
    assert quantise(np.array([5 - 5j]), 4)[0] == (1 - 1 / 8) - 1j
    assert quantise(np.array([0.124 + 0.2j]), 4)[0] == 0.125 + 0.25j


def test_gain_control_is_exact_and_fills_the_converter() -> None:
    value, gain_db, drawn = run(Impairments(agc=True, agc_step_db=0.5, headroom_db=3.0))
    assert np.allclose(gain_db / 0.5, np.rint(gain_db / 0.5))
    parts = np.maximum(np.abs(value.real), np.abs(value.imag)).max(-1)
    for a in range(3):
        for b in range(3):
            links = parts[:, LAYOUT.tx_device == a][:, :, LAYOUT.rx_device == b].max((1, 2))
            assert (links <= 10**-0.15 * 1.0001).all() and (links > 10**-0.175 * 0.9999).all()
    back = restore(value, drawn, RADIO, LAYOUT, ALL, gain_db)
    assert np.abs(back / clean() - 1).max() < 3e-7


def test_without_gain_control_the_gain_fits_the_empty_scene_and_stays() -> None:
    settings = Impairments(adc_bits=8)
    drawn = draw_impairments(settings, LAYOUT, TIME_S, 0, "x")
    static = 0.5 * clean()[:1]
    random = np.random.default_rng(0)
    value, gain_db = impair(clean(), settings, drawn, RADIO, LAYOUT, ALL, random, static)
    assert (gain_db == gain_db[0]).all()
    # Frames twice as strong as the empty scene clip.
    assert np.isclose(np.abs(value.real).max(), 1.0, atol=0.01)


@pytest.mark.parametrize("kind", ["fixed", "per_sample"])
def test_antennas_change_places_within_their_device(kind: str) -> None:
    settings = Impairments(permutation=kind)  # type: ignore[arg-type]
    value, _, drawn = run(settings)
    order = drawn.rx_order
    assert (LAYOUT.rx_device[order] == LAYOUT.rx_device).all()
    assert (np.sort(order, axis=1) == np.arange(order.shape[1])).all()
    assert (order != np.arange(order.shape[1])).any()
    assert (order == order[0]).all() == (kind == "fixed")
    assert np.array_equal(value[7, :, 2], clean()[7, :, order[7, 2]])
    assert np.array_equal(restored(settings), clean())


def test_lost_packets_are_absent_in_bursts_of_the_asked_length() -> None:
    settings = Impairments(loss_rate=0.1, loss_burst=4.0)
    times_s = np.arange(30_000) * 1e-3
    received = draw_impairments(settings, LAYOUT, times_s, 3, "x").packet_received
    lost = ~received[:, APART_DEVICES[0], APART_DEVICES[1]]
    assert np.isclose(lost.mean(), 0.1, rtol=0.1)
    starts = lost[1:] & ~lost[:-1]
    assert np.isclose(lost.sum() / starts.sum(), 4.0, rtol=0.1)
    assert received[:, [0, 1, 2], [0, 1, 2]].all()
    value, _, drawn = run(replace(settings, loss_rate=0.3))
    gone = ~drawn.packet_received[:, LAYOUT.tx_device[:, None], LAYOUT.rx_device[None]]
    assert gone.any() and np.array_equal(np.isnan(value).all(-1), gone)
    assert np.array_equal(np.isnan(value).any(-1), gone)
    assert np.array_equal(value[~gone], clean()[~gone])


APART_DEVICES = np.nonzero(~np.eye(3, dtype=bool))


def test_timestamps_keep_the_true_time_to_their_step() -> None:
    drawn = run(Impairments(timestamp_step_s=4e-3))[2]
    assert np.allclose(drawn.timestamp_s / 4e-3, np.rint(drawn.timestamp_s / 4e-3))
    late_s = TIME_S[:, None] - drawn.timestamp_s
    assert (late_s > -1e-9).all() and (late_s < 4e-3).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"cfo_std_hz": 500.0},
        {"sfo_std_ppm": 5.0},
        {"sto_std_s": 3e-8},
        {"phase_noise_rms_deg": 5.0},
        {"agc": True},
        {"permutation": "per_sample"},
        {"cfo_std_hz": 500.0, "sto_std_s": 3e-8, "agc": True, "permutation": "fixed"},
    ],
)
def test_what_is_known_is_taken_back_to_rounding(changes: dict) -> None:
    assert np.abs(restored(Impairments(**changes)) / clean() - 1).max() < 1e-6


def test_everything_together_is_taken_back_to_its_own_noise() -> None:
    settings = replace(IMPAIRMENT_PRESETS["commodity"], power_dbm=-20.0)
    value, gain_db, drawn = run(settings)
    back = restore(value, drawn, RADIO, LAYOUT, ALL, gain_db)
    there = np.isfinite(back)
    assert np.array_equal(there, np.isfinite(value)) and 0.9 < there.mean() < 1.0
    gain = 10 ** (gain_db[:, LAYOUT.tx_device[:, None], LAYOUT.rx_device] / 20)[..., None]
    expected = noise_variance(settings, RADIO) + 2 * (2.0**-7) ** 2 / 12 / gain**2
    error = np.abs(back - clean()) ** 2 / expected
    low, high = stats.chi2.interval(0.9999, 2 * there.sum())
    # The sum of a uniform and a normal error has less spread than chi-square allows for.
    assert low < 2 * error[there].sum() < high


def test_draws_are_seeded_and_independent_of_each_other() -> None:
    full = IMPAIRMENT_PRESETS["commodity"]
    first, again, other = run(full)[2], run(full)[2], run(full, seed=1)[2]
    for spec in fields(Draw):
        assert np.array_equal(getattr(first, spec.name), getattr(again, spec.name))
    assert not np.allclose(first.cfo_hz, other.cfo_hz)
    without = run(replace(full, sfo_std_ppm=0.0, loss_rate=0.0))[2]
    assert np.array_equal(first.cfo_hz, without.cfo_hz)
    assert np.array_equal(first.sto_s, without.sto_s)
    assert np.array_equal(first.phase_noise_rad, without.phase_noise_rad)


def test_links_that_are_not_measured_stay_silent() -> None:
    radar = replace(RADIO, own_device_links="only")
    elements = layout(radar, place_devices(radar, BOUNDS_M))
    settings = IMPAIRMENT_PRESETS["commodity"]
    drawn = draw_impairments(settings, elements, TIME_S, 0, "x")
    value = clean() * elements.measured[..., None]
    random = np.random.default_rng(0)
    changed, _ = impair(value, settings, drawn, radar, elements, ALL, random, value[:1])
    assert not changed[:, ~elements.measured].any()
    assert np.isfinite(changed).all()


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"adc_bits": 30}, "adc_bits: expected 0 to 24, found 30"),
        ({"adc_bits": 8.5}, "expected a whole number"),
        ({"cfo_std_hz": float("nan")}, "expected JSON, got something else"),
        ({"cfo_std_hz": "fast"}, "expected a number, found 'fast'"),
        ({"permutation": "random"}, "expected fixed or none or per_sample, found 'random'"),
        ({"agc": 1}, "expected true or false"),
        ({"loss_rate": 1.0}, "loss_rate: expected 0 to 0.99"),
        ({"colour": 1}, "unknown setting 'colour'"),
    ],
)
def test_wrong_settings_are_refused(tmp_path: Path, changes: dict, word: str) -> None:
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(changes))
    with pytest.raises(RfgsError, match=r"mine\.json") as error:
        read_impairments(str(file))
    assert word in str(error.value)


def test_settings_come_from_presets_and_files(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    file.write_text('{"thermal_noise": true, "cfo_std_hz": 100}')
    assert read_impairments(str(file)) == Impairments(thermal_noise=True, cfo_std_hz=100.0)
    assert read_impairments("lab") == IMPAIRMENT_PRESETS["lab"]
    with pytest.raises(RfgsError, match="commodity, lab, thermal"):
        read_impairments("nowhere")
