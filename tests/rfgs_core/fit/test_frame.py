# SPDX-License-Identifier: Apache-2.0
"""Stages of one frame: visibility, powers, noise levels and the warm start."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.dataset import open_dataset
from rfgs_core.encode import PAPER_FILTER
from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import solve_reflectivity, start_anywhere, start_frame
from rfgs_core.fit.sampling import encode
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.model import first_powers
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import comparison_of
from rfgs_core.model.delay_power import DelayPowerModel
from rfgs_core.model.first_powers import fit_power, level_of_power, noise_per_link, visibility
from rfgs_core.settings import TrainConfig, TrainOptions


@pytest.fixture
def observations(tiny_dataset: Path) -> Observations:
    return observe(open_dataset(tiny_dataset).sequence(), "wifi", 1)


def test_visibility_is_the_propagation_models_own(observations) -> None:
    """A logistic step of steepness 6 towards both ends, squared for power."""
    point = np.array([[1.5, 1.5, 1.0]])
    normal = np.array([[1.0, 0.0, 0.0]])
    model = DelayPowerModel(observations, point)
    got = visibility(point, normal, model)
    assert got.shape == (len(model.maps), 1)
    for row, entry in zip(got[:, 0], model.maps, strict=True):
        expected = 1.0
        for end in (entry.tx_xyz.mean(axis=0), entry.rx_xyz.mean(axis=0)):
            towards = end - point[0]
            expected /= 1 + math.exp(-6.0 * towards[0] / np.linalg.norm(towards))
        assert row == pytest.approx(expected**2, rel=1e-5)
    both = visibility(np.repeat(point, 2, axis=0), np.array([[1.0, 0, 0], [-1.0, 0, 0]]), model)
    assert (both[:, 0] != both[:, 1]).all()


def test_a_frame_without_anybody_is_refused(observations) -> None:
    silent = observations.with_delta(np.zeros_like(observations.delta))
    with pytest.raises(RfgsError, match=r"nobody is in it; choose other --frames.*--depth"):
        start_frame(silent, TrainConfig(), seed=0, before=None)


def test_a_pair_that_nothing_changes_leaves_powers_finite(observations) -> None:
    """Furniture may hide a person from one pair of devices."""
    delta = observations.delta.copy()
    pair, names = observations.pairs
    delta[pair == 1] = 0.0
    silent = observations.with_delta(delta)
    state = start_frame(silent, TrainConfig(num_gaussians=64), seed=0, before=None)
    assert len(names) > 1 and torch.isfinite(state.power).all() and (state.power > 0).all()


def test_noise_is_a_share_of_each_pairs_mean_power(observations) -> None:
    target = comparison_of(observations).measured()
    assert target.shape == (84, 14)
    noise = noise_per_link(observations, target, 0.5)
    pair, names = observations.pairs
    index = pair[observations.links]
    power = (target.abs() ** 2).mean(dim=1).numpy()
    for number in range(len(names)):
        expected = 0.5 * power[index == number].mean()
        np.testing.assert_allclose(noise[index == number], expected, rtol=1e-5)


def test_a_silent_pair_is_not_trusted_without_end(observations) -> None:
    pair, _ = observations.pairs
    delta = np.where((pair == 2)[..., None], 0, observations.delta)
    quiet = observations.with_delta(delta)
    noise = noise_per_link(quiet, comparison_of(quiet).measured(), 0.5)
    assert (noise > 0).all()


def test_target_keeps_the_order_of_links(observations) -> None:
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    subcarriers = np.flatnonzero(observations.subcarriers)
    expected = observations.delta[channel.tx, channel.rx][:, subcarriers]
    np.testing.assert_array_equal(comparison_of(observations).measured(), expected)


def test_powers_follow_the_channels_scale(observations, make_gaussians) -> None:
    """Ten times the channel is a hundred times the power."""
    gaussians = make_gaussians(20)
    power = fit_power(observations, gaussians)
    louder = fit_power(observations.with_delta(10 * observations.delta), gaussians)
    assert (power > 0).all()
    torch.testing.assert_close(louder, 100 * power, rtol=1e-3, atol=0)


def test_all_powers_are_equal(observations, make_gaussians) -> None:
    power = fit_power(observations, make_gaussians(20))
    torch.testing.assert_close(power, power[:1].expand(20))


def test_a_started_frame_reflects_nothing_until_it_is_solved(observations, quick_config) -> None:
    state = start_frame(observations, quick_config, 3, None)
    scale = state.head.gamma_scale_m
    assert state.gamma.abs().max() < 1e-5 * scale
    assert scale == pytest.approx(state.power.mean().sqrt().item(), rel=1e-5)
    solved = solve_reflectivity(observations, state, quick_config)
    assert solved.gamma.abs().max() > 1e-3 * scale
    for name in ("means", "quats", "log_scales", "logit_opacities"):
        assert torch.equal(getattr(solved.gaussians, name), getattr(state.gaussians, name))


def test_later_frames_move_the_earlier_gaussians(tiny_dataset: Path, quick_config) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    first = start_frame(observe(sequence, "wifi", 1), quick_config, 3, None)
    second = start_frame(observe(sequence, "wifi", 2), quick_config, 4, first)
    kept = np.isin(second.track_id, first.track_id)
    assert kept.sum() == 40 - 13
    moved = (second.gaussians.means - first.gaussians.means).numpy()[kept]
    shift = (second.tracks.axes_xy - first.tracks.axes_xy)[0]
    np.testing.assert_allclose(moved[:, :2], np.tile(shift, (len(moved), 1)), atol=1e-5)
    np.testing.assert_allclose(moved[:, 2], 0, atol=1e-6)
    assert second.head is first.head
    assert np.abs(shift).max() <= 0.8 + 1e-9


def test_the_number_of_a_gaussian_that_is_gone_is_not_given_again(
    tiny_dataset: Path, quick_config
) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    first = start_frame(observe(sequence, "wifi", 1), quick_config, 3, None)
    left = replace(
        first,
        gaussians=first.gaussians.select(torch.arange(40) < 39),
        power=first.power[:39],
        track_id=first.track_id[:39],
        next_track=first.unused_track,
    )
    second = start_frame(observe(sequence, "wifi", 2), quick_config, 4, left)
    assert second.track_id[~second.goes_on].min() == 40
    assert second.unused_track == 40 + 13


def test_a_random_start_fills_the_bounds_and_knows_of_no_bodies(observations) -> None:
    config = TrainConfig.chosen(TrainOptions(recipe="paper"), num_gaussians=4000)
    state = start_anywhere(observations, config, 3, None, PAPER_FILTER)
    gaussians, (low, high) = state.gaussians, observations.bounds_m
    share = (gaussians.means.numpy() - low) / (high - low)
    assert share.min() >= 0.0 and share.max() <= 1.0
    # Mean and deviation of a uniform draw, to four deviations of theirs.
    np.testing.assert_allclose(share.mean(axis=0), 0.5, atol=4 * 0.2887 / 4000**0.5)
    np.testing.assert_allclose(share.std(axis=0), 1 / 12**0.5, atol=0.01)
    torch.testing.assert_close(gaussians.scales, torch.full((4000, 3), 0.01))
    torch.testing.assert_close(gaussians.opacities, torch.full((4000,), 0.1))
    here = encode(observations, gaussians.means.numpy().astype(np.float64), PAPER_FILTER)
    torch.testing.assert_close(gaussians.features, here.features, rtol=1e-2, atol=1e-3)
    assert len(state.tracks.bodies.axes_xy) == 0
    assert (state.moving.body == -1).all()
    # Every frame anew: other places, and no number twice.
    after = start_anywhere(observations, config, 4, state, PAPER_FILTER)
    assert not np.isin(after.track_id, state.track_id).any()
    assert not torch.isclose(after.gaussians.means, gaussians.means).all(dim=1).any()
    assert after.head is state.head


@pytest.mark.parametrize("recipe", ["rfgs", "paper"])
def test_many_gaussians_have_the_power_of_a_few(observations, monkeypatch, recipe) -> None:
    """Anywhere in the bounds as in bodies, which stand one after the other in their order."""
    config = TrainConfig.chosen(TrainOptions(recipe=recipe), num_gaussians=6000)
    begin = start_anywhere if recipe == "paper" else start_frame
    many = begin(observations, config, 3, None, PAPER_FILTER).gaussians
    monkeypatch.setattr(first_powers, "_MANY", 5999)
    found, whole = level_of_power(observations, many), fit_power(observations, many)
    assert float(found.sum()) == pytest.approx(float(whole.sum()), rel=0.1)
    assert len(found.unique()) == 1
    assert torch.equal(begin(observations, config, 3, None, PAPER_FILTER).power, found)
    monkeypatch.setattr(first_powers, "_MANY", 6000)
    assert torch.equal(level_of_power(observations, many), whole)
