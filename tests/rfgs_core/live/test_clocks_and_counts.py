# SPDX-License-Identifier: Apache-2.0
"""Device clocks against arrival, and what is counted."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.live.counts import Counts, Times
from rfgs_core.live.records import DeviceClock


def test_a_clock_that_wraps_goes_on() -> None:
    clock = DeviceClock(32)
    start = 2**32 - 2500
    ticks = (start + 1000 * np.arange(6)) % 2**32
    arrived_s = 50.0 + 1e-3 * np.arange(6) + np.array([3, 0, 2, 5, 1, 4]) * 1e-4
    first, new = clock.times_s(ticks[:3], arrived_s[:3])
    second, _ = clock.times_s(ticks[3:], arrived_s[3:])
    assert new.all()
    np.testing.assert_allclose(np.diff(np.concatenate([first, second])), 1e-3, atol=1e-6)


def test_the_fastest_packet_tells_the_offset() -> None:
    rng = np.random.default_rng(0)
    true_s = 7.0 + 1e-3 * np.arange(500)
    delay_s = rng.exponential(5e-3, 500)
    delay_s[17] = 0.0
    clock, found = DeviceClock(32), []
    for part in np.array_split(np.arange(500), 20):
        ticks = np.round(1e6 * (true_s[part] - 6.5)).astype(np.int64)
        found.append(clock.times_s(ticks, true_s[part] + delay_s[part])[0])
    # The offset may have grown by the drift that is allowed, 0.2 ms in a second.
    assert np.abs(np.concatenate(found)[100:] - true_s[100:]).max() < 2e-4


def test_repeated_packets_are_not_new() -> None:
    clock = DeviceClock(32)
    assert clock.times_s(np.array([1000, 2000, 1000]), np.full(3, 5.0))[1].tolist() == [
        True,
        True,
        False,
    ]
    assert clock.times_s(np.array([2000, 3000]), np.full(2, 5.1))[1].tolist() == [False, True]


def test_a_clock_that_is_set_anew_follows_arrival() -> None:
    clock = DeviceClock(32)
    clock.times_s(np.array([10_000_000]), np.array([5.0]))
    time_s, _ = clock.times_s(np.array([700]), np.array([5.2]))
    assert time_s[0] == pytest.approx(5.2)


def test_without_a_clock_arrival_counts() -> None:
    arrived_s = np.array([1.0, 1.5])
    time_s, new = DeviceClock(32).times_s(np.zeros(2, np.int64), arrived_s)
    assert new.all() and (time_s == arrived_s).all()


def test_percentiles_of_times_are_those_of_numpy() -> None:
    times_s = np.random.default_rng(0).uniform(0.0, 0.2, 4001)
    counted = Times()
    for part in np.array_split(times_s, 7):
        counted.add(part)
    assert len(counted) == 4001
    for share in (50.0, 99.0):
        assert counted.percentile_s(share) == pytest.approx(np.percentile(times_s, share), abs=2e-4)
    assert np.isnan(Times().percentile_s(50.0))


def test_counts_add_up_and_say_what_happened() -> None:
    total = Counts(received=5, used=3, too_late=1).plus(
        Counts(received=2, pushed_out=2, before_us=4)
    )
    assert (total.received, total.lost_inside) == (7, 3)
    said = "7 received, 3 used, 1 too late, 2 pushed out, 4 dropped before the program"
    assert str(total) == said
    assert str(Counts()) == "nothing received"
