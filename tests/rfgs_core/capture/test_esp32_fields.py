# SPDX-License-Identifier: Apache-2.0
"""Samples of ESP32 packets are at the subcarriers that Espressif's guide gives them."""

from __future__ import annotations

from pathlib import Path

import capture_files as files
import numpy as np
import pytest

from rfgs_core.capture.cleaned import steps
from rfgs_core.capture.esp32 import decode
from rfgs_core.capture.model import Capture
from rfgs_core.capture.wifi_grid import occupied
from rfgs_core.errors import RfgsFormatError

FROM_ZERO = {n: np.r_[0 : n + 1, -n:0] for n in (26, 28, 58, 60, 122)}
NONE = np.r_[0:32, -32:0]
WIDE = np.r_[0:64, -64:0]


def told(line: str) -> Capture:
    return decode(Path("x.csv"), line.encode()).largest


def numbered(index: np.ndarray) -> np.ndarray:
    """Samples whose real part is the number of their subcarrier."""
    return index + 5j


@pytest.mark.parametrize(
    ("second", "wide", "stbc", "legacy", "ht", "shift"),
    [
        (0, 0, 0, NONE, NONE, 0),
        (0, 0, 1, NONE, NONE, 0),
        (2, 0, 0, np.r_[0:64], np.r_[0:64], 32),
        (2, 0, 1, np.r_[0:64], np.r_[0:63], 32),
        (1, 0, 0, np.r_[-64:0], np.r_[-64:0], -32),
        (1, 0, 1, np.r_[-64:0], np.r_[-62:0], -32),
        (2, 1, 0, np.r_[0:64], WIDE, 0),
        (1, 1, 0, np.r_[-64:0], WIDE, 0),
        (1, 1, 1, np.r_[-64:0], FROM_ZERO[60], 0),
    ],
)
def test_the_ht_field_is_where_the_guide_s_table_has_it(
    second, wide, stbc, legacy, ht, shift
) -> None:
    # A field of the second stream follows, whose values must not be taken.
    fields = [legacy, ht, ht + 200] if stbc else [legacy, ht]
    samples = numbered(np.concatenate(fields))
    assert 2 * len(samples) in (256, 376, 380, 384, 612)
    samples.real = np.clip(samples.real, -127, 127)
    capture = told(files.esp32_line(samples, second=second, wide=wide, stbc=stbc))
    used = occupied("HT", 40 if wide else 20)
    assert used is not None
    valid = capture.valid[0, 0, 0, 0]
    assert capture.index[valid].tolist() == (used + shift).tolist()
    np.testing.assert_array_equal(capture.values[0, 0, 0, 0][valid].real, capture.index[valid])
    # Channel 11, with the middle of two 10 MHz from it.
    assert capture.centre_hz == 2.462e9 + {0: 0.0, 1: 10e6, 2: -10e6}[second]


def test_a_packet_without_its_legacy_field_begins_with_ht() -> None:
    capture = told(files.esp32_line(numbered(WIDE), second=1, wide=1))
    valid = capture.valid[0, 0, 0, 0]
    np.testing.assert_array_equal(capture.values[0, 0, 0, 0][valid].real, capture.index[valid])
    # 0 and 1 carry nothing, so that the two spoilt samples take nothing away.
    used = occupied("HT", 40)
    assert used is not None and capture.index[valid].tolist() == used.tolist()


@pytest.mark.parametrize("count", [63, 65, 100, 122, 191])
def test_as_many_samples_as_in_no_row_are_refused(count) -> None:
    with pytest.raises(RfgsFormatError, match=r"x\.csv"):
        told(files.esp32_line(numbered(np.arange(count)), second=1, wide=1))


@pytest.mark.parametrize("order", ["rising", "from zero"])
@pytest.mark.parametrize("stbc", [False, True])
@pytest.mark.parametrize(
    ("form", "mhz", "far"), [("non-HT", 20, 26), ("HT", 20, 28), ("HT", 40, 58), ("HE", 20, 122)]
)
def test_new_chips_tell_the_order_by_the_empty_middle(form, mhz, far, stbc, order) -> None:
    used = occupied(form, mhz)
    assert used is not None
    index = np.arange(-far, far + 1) if order == "rising" else FROM_ZERO[far]
    there = np.where(np.isin(index, used), numbered(index) + 0, 1 + 0j)
    there.imag[np.isin(index, used)] = 90.0
    line = files.new_esp32_line(np.concatenate([there, there + 3]) if stbc else there)
    capture = told(line)
    valid = capture.valid[0, 0, 0, 0]
    np.testing.assert_array_equal(capture.values[0, 0, 0, 0][valid].real, capture.index[valid])
    spoilt = set(index[:2].tolist())
    assert set(capture.index[valid].tolist()) == set(used.tolist()) - spoilt
    assert capture.info == {"bandwidth_mhz": mhz, "format": form}
    assert np.diff(capture.bins)[0] == (78_125.0 if form == "HE" else 312_500.0)
    # On which side the second channel lies is in no field of these lines.
    assert capture.centre_hz == (None if mhz == 40 else 2.462e9)


def test_both_gains_of_new_chips_are_undone() -> None:
    index = np.arange(-28, 29)
    there = np.where(index == 0, 0, 40 + 30j)
    gains = [(20, 8), (20, 252), (23, 8), (19, 12)]
    lines = [files.new_esp32_line(there, time, agc, fft) for time, (agc, fft) in enumerate(gains)]
    capture = told("".join(lines))
    step, scaled = next((step.name, step.capture) for step in steps(capture))
    assert "gain" in step
    level = np.abs(scaled.values[:, 0, 0, 0, 40])
    # 252 is −4 of a signed byte: 1 dB less by the FFT's quarters and 2 dB in all.
    expected_db = -np.array([20 + 2, 20 - 1, 23 + 2, 19 + 3])
    np.testing.assert_allclose(20 * np.log10(level / 50.0), expected_db, atol=1e-4)
