# SPDX-License-Identifier: Apache-2.0
"""What training does to maps, and what is done to filtered ones before a network is asked."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.limbs.disturb import filtered
from rfgs_core.limbs.propose import with_noise
from rfgs_core.limbs.tokens import Packed

FRAMES = 600
#: Cells of every map, below its peak [dB].
CELLS_DB = -np.arange(35.0 * 4) * 0.5


def frames(legs_m: tuple[float, ...], level: float = -4.0) -> tuple[torch.Tensor, Packed]:
    """Equal maps of pairs whose devices are `legs_m` from the body, and their frames."""
    pairs = len(legs_m)
    power = torch.tensor(10.0 ** (CELLS_DB / 10.0), dtype=torch.float32).reshape(7, 5, 4)
    vectors = torch.zeros(FRAMES, pairs, 6, 3)
    vectors[:, :, :2, 0] = torch.tensor(legs_m)[:, None]
    packed = Packed(
        torch.zeros(FRAMES, pairs, 7, 5, 4, dtype=torch.uint8),
        torch.full((FRAMES, pairs), level),
        vectors,
        torch.zeros(FRAMES, pairs, 4),
        torch.ones(FRAMES, pairs, dtype=torch.bool),
    )
    return power.expand(FRAMES, pairs, 7, 5, 4).contiguous(), packed


@pytest.fixture
def generator() -> torch.Generator:
    return torch.Generator().manual_seed(3)


def test_a_filter_drops_what_is_faint_and_damps_what_is_loud(generator: torch.Generator) -> None:
    power, packed = frames((2.0,))
    kept = filtered(power, packed, generator).flatten(1) / power.flatten(1)
    changed = (kept - 1.0).abs().amax(1) > 1e-3
    assert 0.2 < float(changed.float().mean()) < 0.4
    torch.testing.assert_close(kept[~changed], torch.ones_like(kept[~changed]))
    some = kept[changed]
    # The peak stays above the filter's bar; what is 60 dB below it never does.
    assert (some[:, 0] > 0.0).all()
    assert (some[:, CELLS_DB < -60.0] == 0.0).all()
    # Never more than without noise, but for what noise itself adds.
    assert float((some > 1.05).float().mean()) < 0.01
    # Whoever is louder keeps the larger share.
    loud, less = some[:, :8].mean(1), some[:, 8:16].mean(1)
    assert (loud >= less).all()


def test_who_is_farther_away_has_the_same_noise_in_the_channel(generator: torch.Generator) -> None:
    """Twice as far, the same echo area is 12 dB fainter, so 12 dB more of the map are lost."""
    power, packed = frames((2.0, 4.0))
    kept = (filtered(power, packed, generator) > 0.0).flatten(2).sum(2)
    changed = kept[:, 0] < len(CELLS_DB)
    lost_more_db = 0.5 * (kept[:, 0] - kept[:, 1])[changed].double()
    # Near the peak a far pair has nothing left to lose.
    deep = kept[changed][:, 0] > 40
    np.testing.assert_allclose(lost_more_db[deep], 10.0 * np.log10(16.0), atol=2.0)


def test_as_much_noise_is_put_back_as_makes_the_network_surest() -> None:
    maps = np.zeros((1, 7, 5, 4), dtype=np.float32)
    maps[0, 3, 2, 1] = 1.0

    def said(noisy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        level = np.log10(max(noisy.mean() - 1.0 / maps.size, 1e-6))
        return np.full((17, 3), level), np.full(17, 0.05 + abs(level + 1.5))

    joints, sigma = with_noise(said, maps)
    assert joints.mean() == pytest.approx(-1.5, abs=0.1)
    assert sigma.shape == (17,)
    assert sigma.mean() < 0.15


@pytest.mark.parametrize("sigma_m, asked", [(0.09, 1), (0.11, 13)])
def test_a_network_that_is_sure_is_asked_without_noise(sigma_m: float, asked: int) -> None:
    maps = np.ones((1, 7, 5, 4), dtype=np.float32)
    heard = []

    def said(noisy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        heard.append(noisy)
        return np.zeros((17, 3)), np.full(17, sigma_m)

    with_noise(said, maps)
    assert len(heard) == asked
    np.testing.assert_array_equal(heard[0], maps)
