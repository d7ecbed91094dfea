# SPDX-License-Identifier: Apache-2.0
"""Collapse is seen in features that were made to collapse, and not in others."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.encode.spread import FeatureSpread


@pytest.mark.parametrize("dimensions", [2, 8, 32])
def test_rank_counts_equal_dimensions(dimensions: int) -> None:
    values = np.zeros((dimensions * 2, 32))
    values[np.arange(dimensions * 2), np.arange(dimensions * 2) % dimensions] = np.repeat(
        [1.0, -1.0], dimensions
    )
    spread = FeatureSpread.of(values)
    assert spread.rank == pytest.approx(dimensions, rel=1e-9)
    assert spread.deviation == pytest.approx(1.0)
    assert not spread.collapsed


def test_constant_silent_and_one_dimensional_features_have_collapsed() -> None:
    rng = np.random.default_rng(0)
    row = rng.random(32)
    assert FeatureSpread.of(np.tile(row, (50, 1))) == FeatureSpread(0.0, 0.0)
    assert FeatureSpread.of(np.zeros((50, 32))).collapsed
    line = rng.random((50, 1)) * row
    assert FeatureSpread.of(line).rank == pytest.approx(1.0, rel=1e-3)
    assert FeatureSpread.of(line).collapsed
    assert FeatureSpread.of(row + 1e-3 * rng.standard_normal((50, 32))).collapsed


def test_scale_does_not_matter() -> None:
    values = np.random.default_rng(1).random((80, 32))
    first, second = FeatureSpread.of(values), FeatureSpread.of(1e-9 * values)
    assert second.rank == pytest.approx(first.rank)
    assert second.deviation == pytest.approx(first.deviation)
