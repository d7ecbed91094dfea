# SPDX-License-Identifier: Apache-2.0
"""Sub-seeds are the same everywhere and different for different purposes."""

from __future__ import annotations

import pytest

from rfgs_core.seeds import sub_seed


def test_known_values_do_not_change_between_machines_or_versions() -> None:
    # First 31 bits of SHA-256 of "0" and of "7", US, "wifi", US, "1" (sha256sum).
    assert sub_seed(0) == 0x5FECEB66 >> 1
    assert sub_seed(7, "wifi", 1) == sub_seed(7, "wifi", "1") == 0xB2BC6E39 >> 1


def test_seeds_fit_31_bits_and_rarely_collide() -> None:
    seeds = [sub_seed(root, "frame", frame) for root in (-1, 0, 1) for frame in range(1000)]
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert len(set(seeds)) == len(seeds)
    # A 31-bit number uses its top half about half of the time: 6 standard deviations.
    high = sum(seed >= 2**30 for seed in seeds)
    assert abs(high - 1500) < 6 * (3000 * 0.25) ** 0.5


@pytest.mark.parametrize(
    "other", [(0, "b", "a"), (0, "ab"), (0, "a", "b", ""), (1, "a", "b"), (0, "a", "b", 0)]
)
def test_every_part_its_order_and_its_ends_count(other: tuple) -> None:
    assert sub_seed(0, "a", "b") != sub_seed(*other)
