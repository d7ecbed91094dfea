# SPDX-License-Identifier: Apache-2.0
"""Parts of the predicted channel are cut from the whole."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.gaussians import Gaussians
from rfgs_core.model.channel import Channel
from rfgs_core.model.head import RadioHead


@pytest.fixture
def head() -> RadioHead:
    return RadioHead.create(0, 0.0517, 0.04, 0.02)


def test_rows_are_slices_of_the_whole(make_observations, make_gaussians, head) -> None:
    observations = make_observations()
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    whole = channel.change(head, make_gaussians(12))
    assert whole.shape == (256, 32)
    # Neither contiguous nor ascending: links with and without a direct path.
    chosen = np.random.default_rng(0).permutation(256)[:40]
    part = channel.rows(chosen)
    torch.testing.assert_close(
        part.change(head, make_gaussians(12)), whole[chosen], rtol=1e-5, atol=1e-9
    )
    np.testing.assert_array_equal(part.tx, channel.tx[chosen])
    np.testing.assert_array_equal(part.rx, channel.rx[chosen])
    assert len(part.paths) == np.isin(channel.paths.link.numpy(), chosen).sum()


def test_subcarriers_and_links_are_slices_of_the_whole(
    make_observations, make_gaussians, head
) -> None:
    gaussians = make_gaussians(9)
    everything = make_observations()
    channel = Channel.of(everything, everything.links, everything.subcarriers)
    whole = np.zeros((4, 64, 32), np.complex64)
    whole[channel.tx, channel.rx] = channel.change(head, gaussians).numpy()
    subcarriers = np.ones(32, bool)
    subcarriers[[0, 7, 8, 9, 31]] = False
    links = np.random.default_rng(1).random((4, 64)) < 0.4
    part = Channel.of(everything, links, subcarriers)
    got = part.change(head, gaussians).numpy()
    np.testing.assert_allclose(got, whole[links][:, subcarriers], rtol=1e-5, atol=1e-9)


def test_the_change_is_scattering_plus_shadow(make_observations, make_gaussians, head) -> None:
    observations = make_observations()
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    gaussians = make_gaussians(12)
    scattered, shadowed = channel.scattered(head, gaussians), channel.shadowed(head, gaussians)
    torch.testing.assert_close(channel.change(head, gaussians), scattered + shadowed)
    assert shadowed.abs().max() > 0
    # Gaussians without reflectivity or without opacity leave the other part alone.
    dark = head.without_readings(gaussians.features)
    gaussians.features = dark
    assert channel.scattered(head, gaussians).abs().max() < 1e-4 * scattered.abs().max()
    gaussians.logit_opacities = torch.full((12,), -40.0)
    assert channel.shadowed(head, gaussians).abs().max() < 1e-6 * shadowed.abs().max()


def test_a_given_reflectivity_replaces_that_of_the_features(
    make_observations, make_gaussians, head
) -> None:
    observations = make_observations()
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    gaussians = make_gaussians(5)
    own = channel.scattered(head, gaussians)
    gamma = head.gamma(gaussians.features)
    torch.testing.assert_close(channel.scattered(head, gaussians, gamma), own)
    torch.testing.assert_close(channel.scattered(head, gaussians, 2j * gamma), 2j * own)


@pytest.mark.parametrize("band", [{}, {"freq_min_hz": 3.1e9, "freq_max_hz": 10.6e9}])
def test_an_opaque_screen_takes_away_the_direct_path(make_observations, head, band: dict) -> None:
    """A wall of opaque blobs before the receiving device leaves little of Friis' path.

    That falls along an ultra-wide band, from 1.5 times its middle's amplitude to two thirds.
    """
    observations = make_observations(**band)
    elements = observations.layout
    chosen = (elements.tx_device[:, None] == 0) & (elements.rx_device == 2)
    channel = Channel.of(observations, chosen, observations.subcarriers)
    a, b = elements.tx_xyz[0], elements.rx_xyz[elements.rx_device == 2].mean(axis=0)
    along = (b - a) / np.linalg.norm(b - a)
    side = np.cross(along, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, along)
    grid = np.arange(-1.0, 1.01, 0.08)
    first, second = (axis.ravel() for axis in np.meshgrid(grid, grid))
    means = 0.5 * (a + b) + first[:, None] * side + second[:, None] * up
    count = len(means)
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1.0
    wall = Gaussians(
        means=torch.from_numpy(means).float(),
        quats=quats,
        log_scales=torch.full((count, 3), float(np.log(0.06))),
        logit_opacities=torch.full((count,), 2.0),
        features=torch.zeros(count, 32),
    )
    static = observations.static[chosen]
    left = static + channel.change(head, wall).numpy()
    assert (np.abs(left) / np.abs(static)).max() < 0.1
    if not band:
        assert np.abs(left).max() < 0.1 * np.abs(static).min()
