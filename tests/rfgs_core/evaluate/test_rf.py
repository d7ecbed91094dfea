# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.dataset.splits import HeldOut
from rfgs_core.evaluate.rf import frame_rf, pool_rf, rf_values, snr_db
from rfgs_core.radio import Layout

#: Two devices, each with one transmitting and four receiving elements.
ELEMENTS = Layout(
    tx_xyz=np.zeros((2, 3)),
    rx_xyz=np.zeros((8, 3)),
    tx_device=np.array([0, 1]),
    rx_device=np.repeat([0, 1], 4),
    rx_column=np.tile(np.arange(4), 2),
    measured=np.ones((2, 8), bool),
    tx_port=np.zeros(2, int),
    rx_port=np.zeros(8, int),
    tx_site=np.array([0, 1]),
    rx_site=np.repeat([0, 1], 4),
    tx_quat_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
    rx_quat_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (8, 1)),
)
SPLIT = {"rx_elements": [3, 7], "subcarriers": [5, 6], "device_pairs": [[0, 1]]}


def held_out() -> HeldOut:
    return HeldOut.of(SPLIT, ELEMENTS, 16)


def channel(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(2, 8, 16)) + 1j * rng.normal(size=(2, 8, 16))


def score(true: np.ndarray, predicted: np.ndarray) -> dict:
    return frame_rf(true, predicted, held_out(), ELEMENTS)


def test_kinds_of_held_out_entries_do_not_overlap() -> None:
    held = held_out()
    pair = np.repeat(held.pair_links[:, :, None], 16, axis=2)
    total = held.element.astype(int) + held.subcarrier + held.visible + pair
    # Only held-out subcarriers of held-out elements belong to none of them.
    corner = held.element_links[:, :, None] & np.isin(np.arange(16), [5, 6])
    np.testing.assert_array_equal(total, 1 - corner)


def test_unordered_pair_is_held_out_in_both_directions() -> None:
    links = held_out().pair_links
    assert links[0, 4:].all() and links[1, :4].all()
    assert not links[0, :4].any() and not links[1, 4:].any()


def test_snr_of_a_uniform_relative_error_is_its_level() -> None:
    true = channel()
    values = rf_values(score(true, true * 0.9))
    assert values["element_snr_db"] == pytest.approx(20.0)
    assert values["subcarrier_snr_db"] == pytest.approx(20.0)
    assert values["device_gain_mae_db"] == pytest.approx(-20 * np.log10(0.9))
    assert values["delay_profile_corr"] == pytest.approx(1.0)


def test_a_prediction_of_zero_is_zero_decibels_and_has_no_gain() -> None:
    values = rf_values(score(channel(), np.zeros((2, 8, 16), complex)))
    assert values["element_snr_db"] == pytest.approx(0.0)
    assert values["device_gain_mae_db"] is None
    assert values["delay_profile_corr"] is None


def test_pooled_ratio_is_one_of_sums_and_the_median_stands_beside_it() -> None:
    true = channel()
    frames = [score(true, true * 0.9), score(10 * true, true * 5), score(true, true * 0.9)]
    pooled = pool_rf(frames)
    # Error powers 0.01, 25, 0.01 of powers 1, 100, 1.
    assert pooled["element_snr_db"] == pytest.approx(10 * np.log10(102 / 25.02), abs=1e-6)
    assert pooled["element_snr_median_db"] == pytest.approx(20.0)


def test_errors_of_visible_entries_do_not_count() -> None:
    true = channel()
    wrong = np.where(held_out().visible, 100.0, true)
    values = rf_values(score(true, wrong))
    assert values["element_snr_db"] is not None and values["element_snr_db"] > 100
    assert values["subcarrier_snr_db"] is not None and values["subcarrier_snr_db"] > 100
    assert values["device_gain_mae_db"] == pytest.approx(0.0)


def test_delay_profiles_of_different_paths_do_not_correlate() -> None:
    subcarrier = np.arange(16)
    true = np.ones((2, 8, 1)) * np.exp(-2j * np.pi * subcarrier * 3 / 16)
    other = np.ones((2, 8, 1)) * np.exp(-2j * np.pi * subcarrier * 11 / 16)
    value = rf_values(score(true, other))["delay_profile_corr"]
    assert value is not None and value < 0.1


def test_snr_without_power_is_unknown() -> None:
    assert snr_db(0.0, 0.0) is None
