# SPDX-License-Identifier: Apache-2.0
"""Each step of sanitisation takes away what was put on, and nothing else."""

from __future__ import annotations

import capture_files as files
import numpy as np
import pytest

from rfgs_core import sanitize
from rfgs_core.capture import read_capture
from rfgs_core.capture.wifi_grid import INTEL_5300, occupied
from rfgs_core.radio.levels import amplitude_of
from rfgs_core.sanitize import outliers
from rfgs_core.sanitize.phase import rotations

INDEX = np.array(INTEL_5300[20])


def multipath(index: np.ndarray, times: int = 7, antennas: int = 3, seed: int = 1) -> np.ndarray:
    """Three paths of 10 to 60 ns with a phase of their own at each antenna, (time, rx, bin)."""
    generator = np.random.default_rng(seed)
    delay_s = np.array([10e-9, 30e-9, 60e-9])
    gain = np.array([1.0, 0.4, 0.2])
    phase = generator.uniform(0, 2 * np.pi, (times, antennas, 3, 1))
    phase[:] = phase[:1]
    turn = np.exp(1j * phase - 2j * np.pi * delay_s[:, None] * index * 312_500.0)
    return (gain[:, None] * turn).sum(axis=2)


def test_gaps_are_filled_along_turning_phasors() -> None:
    index = occupied("VHT", 80)
    assert index is not None
    smooth = multipath(index) * np.exp(-0.7j * index)
    valid = np.ones(len(index), bool)
    valid[::9] = False
    spoilt = np.where(valid, smooth, 1e4)
    filled = sanitize.fill_gaps(spoilt, valid, index)
    np.testing.assert_array_equal(filled[..., valid], smooth[..., valid])
    error = np.abs(filled - smooth)[..., ~valid].max() / np.abs(smooth).mean()
    assert error < 0.03
    # A straight line between the neighbours alone fades where the phase turns.
    naive = np.array([np.interp(index, index[valid], row[valid].real) for row in smooth[:, 0]])
    assert np.abs(naive - smooth[:, 0].real)[:, ~valid].max() > 10 * error


def test_gaps_of_each_link_are_its_own() -> None:
    smooth = multipath(INDEX)
    valid = np.ones(smooth.shape, bool)
    valid[2, 1, 5] = valid[3, 0, :] = False
    spoilt = np.where(valid, smooth, 0)
    filled = sanitize.fill_gaps(spoilt, valid, INDEX)
    assert abs(filled[2, 1, 5] - smooth[2, 1, 5]) < 0.05 and not filled[3, 0].any()
    np.testing.assert_array_equal(filled[valid], smooth[valid])


def test_gain_is_undone_once() -> None:
    smooth = multipath(INDEX)
    gain_db = np.linspace(0, 30, 7)
    heard = smooth * amplitude_of(gain_db)[:, None, None]
    np.testing.assert_allclose(sanitize.undo_gain(heard, gain_db), smooth)


def test_packets_get_the_power_of_their_rssi() -> None:
    heard = multipath(INDEX) * np.arange(1, 8)[:, None, None]
    rssi_dbm = np.array([-40.0, -41.0, -50.0, -60.0, -40.0, np.nan, -30.0])
    scaled = sanitize.scale_to_rssi(heard, rssi_dbm)
    power = (np.abs(scaled) ** 2).sum(axis=(1, 2))
    np.testing.assert_allclose(power, np.nan_to_num(10 ** (rssi_dbm / 10)), atol=1e-15)


@pytest.mark.parametrize("name", ["sample_0x5_64_3000.dat", "walk_post_1597163546.dat"])
def test_intel_channels_are_scaled_as_csiread_does(name: str) -> None:
    csiread = pytest.importorskip("csiread")
    path = files.shared(f"intel5300/{name}")
    capture = read_capture(path).largest
    packets = capture.packets
    ours = sanitize.scale_intel5300(
        capture.values[:, 0], packets["rssi_db"], packets["agc_db"], packets["noise_dbm"]
    )
    num_tx = capture.values.shape[3]
    theirs = csiread.Intel(str(path), nrxnum=3, ntxnum=num_tx, if_report=False)
    theirs.read()
    expected = theirs.get_scaled_csi().transpose(0, 2, 3, 1)
    np.testing.assert_allclose(ours, expected, rtol=2e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("form", "width", "turned"),
    [
        ("HT", 20, {}),
        ("HT", 40, {-58: 1, -2: 1, 2: 1j, 58: 1j}),
        ("VHT", 80, {-122: 1, -65: 1, -64: -1, 2: -1, 122: -1}),
        ("VHT", 160, {-250: 1, -193: 1, -192: -1, -6: -1, 6: 1, 63: 1, 64: -1, 250: -1}),
        ("HE", 160, {-1012: 1, 1012: 1}),
    ],
)
def test_rotations_of_the_standard(form: str, width: int, turned: dict[int, complex]) -> None:
    index = occupied(form, width)
    assert index is not None
    factor = rotations(index, form, width)
    for number, expected in turned.items():
        assert factor[index == number][0] == expected
    smooth = multipath(index)
    undone = sanitize.undo_rotations(smooth * factor, index, form, width)
    np.testing.assert_allclose(undone, smooth)


def test_one_slope_for_all_antennas_keeps_angles() -> None:
    smooth = multipath(INDEX)
    generator = np.random.default_rng(2)
    slope, offset = generator.uniform(-1.5, 1.5, 7), generator.uniform(-3, 3, 7)
    turn = np.exp(1j * (slope[:, None] * INDEX + offset[:, None]))[:, None]
    cleaned = sanitize.remove_linear_phase(smooth * turn, INDEX)
    # All packets are alike again, and antennas keep their relative phases.
    np.testing.assert_allclose(cleaned, np.broadcast_to(cleaned[:1], cleaned.shape), atol=1e-6)
    relative = cleaned[:, 1:] * np.conj(cleaned[:, :1])
    np.testing.assert_allclose(relative, smooth[:, 1:] * np.conj(smooth[:, :1]), atol=1e-6)
    np.testing.assert_allclose(np.abs(cleaned), np.abs(smooth))


def test_a_slope_of_each_antenna_would_take_the_angle_along() -> None:
    """Two antennas with delays of their own keep the difference."""
    delays = np.array([20e-9, 45e-9])[:, None]
    values = np.exp(-2j * np.pi * delays * INDEX * 312_500.0)[None]
    cleaned = sanitize.remove_linear_phase(values, INDEX)
    left = np.angle(cleaned[0, 0] * np.conj(cleaned[0, 1]))
    expected = np.angle(values[0, 0] * np.conj(values[0, 1]))
    np.testing.assert_allclose(left, expected, atol=1e-6)


def test_phases_unwrap_over_the_holes_of_the_grid() -> None:
    slope = 1.9
    values = np.exp(1j * (slope * INDEX + 0.3))
    phase, doubtful = sanitize.unwrap(values, INDEX)
    np.testing.assert_allclose(np.diff(phase) / np.diff(INDEX), slope)
    assert not doubtful.any()
    # Plain unwrapping takes the holes between −2, −1 and 1 for the same step as the others.
    naive = np.unwrap(np.angle(values))
    assert not np.allclose(np.diff(naive) / np.diff(INDEX), slope)
    values[10:] *= np.exp(2.8j)
    assert sanitize.unwrap(values, INDEX)[1].tolist() == [False] * 10 + [True] * 20


def test_products_and_ratios_cancel_what_antennas_share() -> None:
    smooth = multipath(INDEX)
    generator = np.random.default_rng(3)
    shared = generator.normal(size=(7, 1, 30)) + 1j * generator.normal(size=(7, 1, 30))
    turn = shared / np.abs(shared)
    before = sanitize.conjugate_product(smooth, 0)
    np.testing.assert_allclose(sanitize.conjugate_product(smooth * turn, 0), before)
    ratio = sanitize.csi_ratio(smooth * shared, 2)
    np.testing.assert_allclose(ratio, smooth[:, :2] / smooth[:, 2:])
    smooth[4, 2, 7] = 1e-9
    ratio = sanitize.csi_ratio(smooth, 2)
    assert np.isnan(ratio[4, :, 7]).all() and np.isnan(ratio).sum() == 2


def test_the_steadiest_antenna_is_the_reference() -> None:
    generator = np.random.default_rng(4)
    level = (
        np.array([1.0, 10.0, 30.0])[:, None]
        + generator.normal(size=(200, 3, 30)) * (np.array([0.3, 1.0, 9.0])[:, None])
    )
    assert sanitize.reference_antenna(level + 0j) == 1


def moving(rate_hz: float, doppler_hz: float) -> np.ndarray:
    """A static path and a moving one at three antennas, with a random phase per packet."""
    time_s = np.arange(int(4 * rate_hz)) / rate_hz
    generator = np.random.default_rng(5)
    still = 10 * np.exp(1j * np.array([0.3, 1.9, -1.0]))
    echo = (
        np.exp(1j * np.array([0.1, -2.0, 2.2])) * np.exp(2j * np.pi * doppler_hz * time_s)[:, None]
    )
    random = np.exp(1j * generator.uniform(0, 2 * np.pi, (len(time_s), 1)))
    return ((still + echo) * random)[:, :, None]


def mirror_asymmetry(spectrum: np.ndarray) -> float:
    """Mean |log₁₀| of the power at a Doppler shift over that at its mirror, 0 in the middle."""
    half = spectrum.shape[0] // 2
    above, below = spectrum[half + 1 :], spectrum[:half][::-1]
    use = (above > 0) & (below > 0)
    return float(np.abs(np.log10(above[use] / below[use])).mean()) if use.any() else 0.0


@pytest.mark.parametrize("doppler_hz", [25.0, -25.0])
def test_adjusted_amplitudes_tell_approach_from_retreat(doppler_hz: float) -> None:
    values = moving(500.0, doppler_hz)
    reference = 0
    plain = sanitize.conjugate_product(values, reference)
    shifted = sanitize.conjugate_product(sanitize.adjust_amplitudes(values, reference), reference)
    found = []
    for product in (plain, shifted):
        series = sanitize.first_component(sanitize.doppler_band(product[:, :, 0], 500.0))
        freq_hz, _, power = sanitize.doppler_spectrum(series, 500.0)
        found.append(mirror_asymmetry(power))
        peak_hz = freq_hz[power.sum(axis=1).argmax()]
    assert peak_hz == pytest.approx(doppler_hz, abs=3.0)
    assert found[1] > 1.3 * found[0]


def test_hampel_replaces_outliers_and_leaves_its_input() -> None:
    generator = np.random.default_rng(6)
    values = (10 + 0.1 * generator.normal(size=(100, 2))) * np.exp(
        1j * generator.normal(size=(100, 2))
    )
    spoilt = values.copy()
    spoilt[30, 0] *= 5
    spoilt[60:62, 1] *= 0.1
    before = spoilt.copy()
    cleaned, changed = sanitize.hampel(spoilt)
    np.testing.assert_array_equal(spoilt, before)
    assert changed[30, 0] and changed[60:62, 1].all()
    assert np.abs(np.abs(cleaned) - 10).max() < 0.5
    np.testing.assert_allclose(np.angle(cleaned), np.angle(values))
    np.testing.assert_array_equal(cleaned[~changed], values[~changed])


@pytest.mark.parametrize("per_cycle", [20, 40, 80])
def test_hampel_leaves_what_only_sways(per_cycle: int) -> None:
    """A crest is far from nobody's median, whatever windows beside it hold."""
    values = 10.0 + np.sin(2 * np.pi * np.arange(400) / per_cycle)
    cleaned, changed = sanitize.hampel(values)
    assert not changed.any()
    np.testing.assert_array_equal(cleaned, values)


def test_hampel_is_its_formula_in_any_number_of_blocks(monkeypatch) -> None:
    values = np.random.default_rng(3).standard_cauchy((60, 3))
    whole = sanitize.hampel(values, 3)
    median, told = np.zeros_like(values), np.zeros(values.shape, bool)
    for at in range(60):
        around = values[np.clip(np.arange(at - 3, at + 4), 0, 59)]
        median[at] = np.median(around, axis=0)
        spread = 3.0 * 1.4826 * np.median(np.abs(around - median[at]), axis=0)
        told[at] = np.abs(values[at] - median[at]) > spread
    np.testing.assert_array_equal(whole[1], told)
    np.testing.assert_array_equal(whole[0], np.where(told, median, values))
    monkeypatch.setattr(outliers, "_BLOCK", 50)
    for one, other in zip(sanitize.hampel(values, 3), whole, strict=True):
        np.testing.assert_array_equal(one, other)


def test_irregular_packets_on_a_common_clock() -> None:
    generator = np.random.default_rng(7)
    time_s = np.sort(generator.uniform(0, 2.0, 800))
    time_s = time_s[(time_s < 1.0) | (time_s > 1.2)]
    other_s = np.arange(300) / 200.0 + 0.3
    ticks_s = sanitize.common_clock([time_s, other_s], 100.0)
    assert ticks_s[0] == 0.3 and ticks_s[-1] <= other_s[-1] and len(ticks_s) == 150
    wave = np.exp(2j * np.pi * 3.0 * time_s)[:, None]
    linear, trusted = sanitize.resample(wave, time_s, ticks_s)
    assert not trusted[(ticks_s > 1.005) & (ticks_s < 1.195)].any()
    assert np.abs(linear[:, 0] - np.exp(6j * np.pi * ticks_s))[trusted].max() < 0.12
    nearest, _ = sanitize.resample(wave, time_s, ticks_s, "nearest")
    assert np.isin(nearest, wave).all()
    outside = sanitize.resample(wave, time_s, np.array([-1.0, 5.0]))[1]
    assert not outside.any()


def test_the_doppler_band_does_not_shift_time() -> None:
    time_s = np.arange(2000) / 500.0
    inside = np.cos(2 * np.pi * 20 * time_s) * np.exp(-(((time_s - 2.0) / 0.3) ** 2))
    values = inside + 5.0 + np.cos(2 * np.pi * 150 * time_s) + 0j
    kept = sanitize.doppler_band(values, 500.0)
    middle = slice(500, 1500)
    assert np.abs(kept.real - inside)[middle].max() < 0.05


def test_normalisation_keeps_its_scale_and_sees_the_training_part_alone() -> None:
    values = multipath(INDEX) * np.array([1, 1, 1, 5, 5, 5, 5])[:, None, None]
    train = np.arange(7) < 3
    normal, scale = sanitize.normalise_power(values, train)
    np.testing.assert_allclose(normal * scale, values)
    np.testing.assert_allclose(np.mean(np.abs(normal[train]) ** 2, axis=0), 1.0)
    assert np.mean(np.abs(normal[~train]) ** 2) == pytest.approx(25.0)


def test_a_path_peaks_at_its_delay_and_amplitude() -> None:
    delay_s = 150e-9
    values = 0.7 * np.exp(-2j * np.pi * delay_s * INDEX * 312_500.0 + 0.4j)
    delays, profile = sanitize.windowed_profile(values, INDEX, 312_500.0, oversample=16)
    assert delays[-1] < 1 / 312_500.0 and delays[0] == 0
    peak = np.abs(profile).argmax()
    assert delays[peak] == pytest.approx(delay_s, abs=5e-9)
    assert abs(profile[peak] - 0.7 * np.exp(0.4j)) < 0.03


def test_quarter_turns_of_antennas_are_taken_back() -> None:
    generator = np.random.default_rng(8)
    drift = np.exp(1j * np.linspace(0, 2, 60))[:, None, None] ** np.array([0, 1, 0.5])[:, None]
    smooth = multipath(INDEX, times=60) * drift
    turns = generator.integers(0, 4, (60, 3))
    turns[0] = 0
    common = np.exp(1j * generator.uniform(-3, 3, (60, 1, 1)))
    turned = smooth * 1j ** turns[..., None] * common
    undone, found = sanitize.undo_quarter_turns(turned)
    # One antenna is the reference: turns are those against it.
    np.testing.assert_array_equal(found, (turns - turns[:, :1]) % 4)
    relative = undone[:, 1:] * np.conj(undone[:, :1])
    np.testing.assert_allclose(relative, smooth[:, 1:] * np.conj(smooth[:, :1]), atol=1e-9)
    assert not sanitize.undo_quarter_turns(smooth * common)[1].any()
