# SPDX-License-Identifier: Apache-2.0
"""The level of unseen device pairs is that of reflected powers without phases."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.model.channel import Channel
from rfgs_core.model.head import RadioHead
from rfgs_core.model.unseen_pairs import expected_power, levelled


@pytest.fixture
def head() -> RadioHead:
    return RadioHead.create(0, 0.0517, 0.04, 0.02)


def test_one_gaussian_has_the_power_of_its_own_channel(
    make_observations, make_gaussians, head: RadioHead
) -> None:
    gaussians = make_gaussians(1)
    # Clear, so that what it casts a shadow on plays no part.
    gaussians.logit_opacities = torch.full((1,), -20.0)
    empty = make_observations()
    middle = len(empty.freq_hz) // 2
    subcarriers = np.arange(len(empty.freq_hz)) == middle
    channel = Channel.of(empty, empty.layout.measured, subcarriers)
    with torch.no_grad():
        change = channel.change(head, gaussians).numpy()[:, 0]
    power = np.abs(head.gamma(gaussians.features).numpy()) ** 2
    for link in (0, len(change) // 2, len(change) - 1):
        ends = empty.layout.tx_xyz[channel.tx[link]], empty.layout.rx_xyz[channel.rx[link]]
        freq_hz = float(empty.freq_hz[middle])
        wanted = expected_power(head, gaussians, power, *ends, freq_hz)
        assert abs(change[link]) ** 2 == pytest.approx(wanted, rel=1e-3)


def test_only_unseen_pairs_change(make_observations, make_gaussians, head: RadioHead) -> None:
    observations, gaussians = make_observations(), make_gaussians(30)
    layout, rng = observations.layout, np.random.default_rng(0)
    csi = rng.normal(size=observations.delta.shape).astype(np.complex64)
    csi[~layout.measured] = 0.0
    unseen = (layout.tx_device[:, None] == 0) & (layout.rx_device == 1)
    visible = layout.measured & ~unseen
    power = np.full(30, 1e-3)
    out = levelled(csi, visible, layout, observations.centre_hz, head, gaussians, power)
    assert np.array_equal(out[~unseen], csi[~unseen])
    ratio = out[unseen & layout.measured] / csi[unseen & layout.measured]
    np.testing.assert_allclose(ratio, ratio.flat[0], rtol=1e-5)
    tx_xyz = layout.tx_xyz[layout.tx_device == 0].mean(axis=0)
    rx_xyz = layout.rx_xyz[layout.rx_device == 1].mean(axis=0)
    wanted = expected_power(head, gaussians, power, tx_xyz, rx_xyz, observations.centre_hz)
    assert np.mean(np.abs(out[unseen & layout.measured]) ** 2) == pytest.approx(wanted, rel=1e-4)
