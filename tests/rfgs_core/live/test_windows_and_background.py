# SPDX-License-Identifier: Apache-2.0
"""Windows on one clock, phases that are turned back, and what stands still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.live.background import Background
from rfgs_core.live.counts import Counts
from rfgs_core.live.phases import Bins, OwnUnits, Straightener
from rfgs_core.live.setting import Heard, Setting, every_nth
from rfgs_core.live.windows import Windows
from rfgs_core.measure.phase_free import direct_wave
from rfgs_core.radio import DevicePose, Radio, layout

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
DEVICES = [
    DevicePose("tx", (0.0, 0.0, 1.2), UPRIGHT, "TRANSMITTER"),
    DevicePose("r1", (4.0, 0.0, 1.2), UPRIGHT, "RECEIVER"),
    DevicePose("r2", (0.0, 4.0, 1.2), UPRIGHT, "RECEIVER"),
]
RADIO = Radio(
    name="small",
    freq_min_hz=5.7e9,
    freq_max_hz=5.86e9,
    num_subcarriers=32,
    tx_rows=1,
    tx_cols=1,
    rx_rows=1,
    rx_cols=2,
    tx_offset_m=(0.0, 0.0, 0.0),
    own_device_links="excluded",
    num_devices=3,
)
SETTING = Setting(
    name="small",
    devices=DEVICES,
    layout=layout(RADIO, DEVICES),
    freq_hz=RADIO.freq_hz,
    subcarriers=np.arange(32) != 7,
    bounds_m=np.array([[0.0, 0.0, 0.0], [4.0, 4.0, 2.5]]),
    reported="complex",
)
BINS = Bins(SETTING.freq_hz, np.arange(32), SETTING.subcarriers, np.arange(32))


def heard(device: int, time_s: list[float], value: float = 1.0) -> Heard:
    times = np.array(time_s)
    values = np.full((len(times), 2, 1, 32), value, np.complex64)
    return Heard(device, times, times + 0.5, values)


def two_counts() -> dict[int, Counts]:
    return {1: Counts(), 2: Counts()}


def test_windows_take_their_own_packets_and_count_late_ones() -> None:
    counts = two_counts()
    windows = Windows(SETTING, counts, step_s=0.1, span_s=0.03)
    assert windows.due(100.0) is None
    windows.add([heard(1, [1.0, 1.05, 1.09, 1.15]), heard(2, [1.02])])
    due = windows.due(1.12)
    assert due == pytest.approx(1.1, abs=1e-5)
    assert due is not None
    window = windows.close(due)
    assert window.links.tolist() == [[True] * 4]
    assert sorted(window.arrived_s) == pytest.approx([1.5, 1.52, 1.55, 1.59])
    windows.add([heard(1, [1.06, 1.17], 9.0), heard(2, [0.05])])
    window = windows.close(1.2)
    # One that is late teaches the background; one that is a second late is left out.
    assert np.abs(window.csi[0, :2]).max() == 9.0
    assert window.links.tolist() == [[True, True, False, False]]
    assert [counts[d].used for d in (1, 2)] == [6, 1]
    assert [counts[d].late for d in (1, 2)] == [1, 0]
    assert [counts[d].too_late for d in (1, 2)] == [0, 1]


def test_the_end_of_a_window_is_its_last_packets() -> None:
    windows = Windows(SETTING, two_counts(), step_s=0.1, span_s=0.03)
    windows.add([heard(1, [1.0], 1.0), heard(1, [1.08, 1.09], 3.0), heard(2, [1.01], 5.0)])
    window = windows.close(1.1)
    assert np.abs(window.csi[0, :2]).max() == np.abs(window.csi[0, :2]).min() == 3.0
    np.testing.assert_allclose(window.mean[0, :2], 7.0 / 3.0, rtol=1e-6)
    # Nothing came near the end of this one: the newest packet stands for it.
    assert (window.csi[0, 2:] == 5.0).all()


def test_powers_are_averaged_without_phases() -> None:
    setting = replace(SETTING, reported="power")
    windows = Windows(setting, two_counts(), step_s=0.1, span_s=0.1)
    windows.add([heard(1, [1.0], 1.0), heard(1, [1.01], -1.0)])
    assert np.abs(windows.close(1.1).csi[0, :2]).min() == 1.0


def test_a_program_that_falls_behind_closes_one_long_window() -> None:
    counts = two_counts()
    windows = Windows(SETTING, counts, step_s=0.1, span_s=0.03)
    windows.add([heard(1, list(np.arange(1.0, 2.0, 0.01)))])
    due = windows.due(1.77)
    assert due == pytest.approx(1.7, abs=1e-4)
    assert due is not None and len(windows.close(due).arrived_s) == 70
    assert counts[1].used == 70 and counts[1].late == 0


def room_and_person(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Channels (packet, rx, tx, subcarrier) of r1 with somebody who walks, and the empty room."""
    wave = np.swapaxes(direct_wave(SETTING.layout, SETTING.freq_hz)[:, :2], 0, 1)
    path_m = (
        5.0 + 0.01 * np.arange(count)[:, None, None, None] + np.array([0.0, 0.4])[:, None, None]
    )
    echo = 0.05 * np.exp(-2j * np.pi * path_m * SETTING.freq_hz / 3e8)
    return (wave + echo).astype(np.complex64), wave


def test_packets_of_any_phase_and_timing_agree_again() -> None:
    clean, wave = room_and_person(400)
    rng = np.random.default_rng(0)
    phase, step = rng.uniform(0, 6, 400), rng.uniform(-0.8, 0.8, 400)
    turn = np.exp(1j * (phase[:, None] + step[:, None] * np.arange(32)))[:, None, None]
    straighten = Straightener(SETTING, 1, BINS)
    found = np.concatenate(
        [straighten(part) for part in np.array_split((clean * turn).astype(np.complex64), 10)]
    )
    # What is left is the person, less the part that looks like a phase or a delay.
    left, true = found[100:] - wave, clean[100:] - wave
    assert np.mean(np.abs(left) ** 2) < 1.1 * np.mean(np.abs(true) ** 2)
    both = np.abs(np.vdot(left, true)) / np.linalg.norm(left) / np.linalg.norm(true)
    assert both > 0.7


def test_gain_is_levelled() -> None:
    setting = replace(SETTING, reported="power")
    clean, _ = room_and_person(5)
    gain = np.array([1, 30, 0.2, 5, 9], np.float32)[:, None, None, None]
    values = OwnUnits(setting, 1, BINS)(clean * gain)
    same = OwnUnits(setting, 1, BINS)(clean)
    np.testing.assert_allclose(values, same, rtol=1e-5)
    power = np.mean(np.abs(values) ** 2)
    assert power == pytest.approx(setting.free_space(1) ** 2, rel=1e-4)


def test_the_background_is_the_mean_and_then_forgets() -> None:
    windows = Windows(SETTING, two_counts(), step_s=0.1, span_s=0.03)
    background = Background(SETTING, learn_s=0.5, memory_s=2.0)
    for number in range(200):
        level = 1.0 if number < 100 else 3.0
        windows.add([heard(1, [1.0 + 0.1 * number], level)])
        window = windows.close(1.05 + 0.1 * number)
        background.learn(window)
        if number == 4:
            assert not background.known.any()
        if number == 99:
            assert background.known.tolist() == [[True, True, False, False]]
            assert not background.change(window).changed
        if number == 100:
            change = background.change(window).delta[0, :2]
            measured = change[:, SETTING.subcarriers]
            np.testing.assert_allclose(measured, 2.0 * (1.0 - 0.1 / 2.0), rtol=1e-4)
            assert not change[:, ~SETTING.subcarriers].any()
    left = np.abs(background.change(window).delta).max()
    assert left == pytest.approx(2.0 * np.exp(-5.0), rel=0.2)


def test_a_recorded_empty_room_is_kept() -> None:
    static = np.full((1, 4, 32), 2.0, np.complex64)
    background = Background(replace(SETTING, static=static), learn_s=5.0, memory_s=1.0)
    windows = Windows(SETTING, two_counts(), step_s=0.1, span_s=0.03)
    for number in range(30):
        windows.add([heard(1, [1.0 + 0.1 * number], 5.0)])
        window = windows.close(1.05 + 0.1 * number)
        background.learn(window)
    assert np.abs(background.change(window).delta).max() == 3.0


def test_followed_subcarriers_are_evenly_spaced() -> None:
    assert every_nth(30).tolist() == list(range(30))
    assert len(every_nth(245)) == 62 and set(np.diff(every_nth(245))) == {4}
