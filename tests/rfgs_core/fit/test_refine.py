# SPDX-License-Identifier: Apache-2.0
"""Descent on one frame: it falls, resumes exactly, and stops at broken data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.errors import RfgsError
from rfgs_core.fit import refine as refine_module
from rfgs_core.fit.frame import FrameState, solved_frame
from rfgs_core.fit.losses import channel_loss
from rfgs_core.fit.refine import refine
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import comparison_of
from rfgs_core.model.first_powers import noise_per_link
from rfgs_core.settings import Density, TrainConfig


def cost(observations: Observations, state: FrameState, config: TrainConfig) -> float:
    """Channel loss over all visible links."""
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    target = comparison_of(observations).measured()
    noise = noise_per_link(observations, target, config.unexplained)
    return channel_loss(channel.change(state.head, state.gaussians), target, noise).item()


def same(first: FrameState, second: FrameState) -> bool:
    return all(
        torch.equal(value, getattr(second.gaussians, name))
        for name, value in first.gaussians.items()
    )


def test_the_channel_loss_falls(observations, state, quick_config) -> None:
    config = replace(quick_config, iterations=60, batch_entries=64 * 32)
    counts = []
    after = refine(observations, state, config, 0, on_step=lambda loss, count: counts.append(count))
    assert counts == [12] * 60
    assert cost(observations, after, config) < 0.5 * cost(observations, state, config)
    np.testing.assert_array_equal(after.track_id, state.track_id)
    assert torch.equal(after.power, state.power)


def test_features_of_many_change_the_channel_no_more_than_those_of_few(
    observations, quick_config, monkeypatch
) -> None:
    """All begin alike, so Adam's first step moves all alike, and what they reflect adds up."""
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    still = dict.fromkeys(("means", "log_scales", "quats", "logit_opacities"), 0.0)
    alone = replace(refine_module.CHANNEL_RATES, **still)
    monkeypatch.setattr(refine_module, "CHANNEL_RATES", alone)

    def first_change(count: int, suited: int) -> float:
        monkeypatch.setattr(refine_module, "_SUITED", suited)
        config = replace(quick_config, num_gaussians=count, iterations=1, batch_entries=4096)
        state = solved_frame(observations, config, 3, settle=False)
        after = refine(observations, state, config, 0)
        moved = [channel.change(one.head, one.gaussians) for one in (state, after)]
        return float((moved[1] - moved[0]).detach().norm())

    few = first_change(200, suited=200)
    assert first_change(800, suited=200) == pytest.approx(few, rel=0.2)
    # At the rates of few, by the root of how many more they are.
    assert first_change(800, suited=800) == pytest.approx(4**0.5 * few, rel=0.2)


@pytest.mark.parametrize("objective", ["paper", "csi", "both"])
def test_each_objective_reports_its_own_loss(objective, observations, state, quick_config) -> None:
    """The loss of the first step, before anything moved: paper + csi = both."""
    config = replace(quick_config, iterations=1, objective=objective)
    losses = {}
    for name in ("paper", "csi", "both"):
        refine(
            *(observations, state, replace(config, objective=name), 3),
            on_step=lambda loss, _count, name=name: losses.__setitem__(name, loss),
        )
    assert losses["paper"] > 0
    assert losses["csi"] > 0
    assert losses["both"] == pytest.approx(losses["paper"] + losses["csi"], rel=1e-5)
    assert refine(observations, state, config, 3).gaussians.means.isfinite().all()


def test_the_papers_loss_falls_and_knows_no_links(observations, state, quick_config) -> None:
    config = replace(quick_config, objective="paper", recipe="paper", iterations=30)
    config = replace(config, batch_points=2000, refine_levels=0)
    losses = []
    refine(observations, state, config, 0, on_step=lambda loss, _: losses.append(loss))
    assert losses[-1] < losses[0]
    louder = replace(observations, static=2 * observations.static)
    config = replace(config, iterations=3)
    after = refine(observations, state, config, 0)
    assert same(refine(louder, state, config, 0), after)
    # The channel's loss sees the direct paths, and so the difference.
    config = replace(config, objective="both")
    both = refine(observations, state, config, 0)
    assert not same(refine(louder, state, config, 0), both)


def test_a_heavy_temporal_weight_holds_those_that_go_on(observations, state, quick_config) -> None:
    going_on = np.arange(12) < 6
    state = replace(state, goes_on=going_on)
    step_m = {}
    for weight in (0.0, 1e3):
        config = replace(quick_config, iterations=30, temporal=weight)
        after = refine(observations, state, config, 0)
        step = torch.linalg.norm(after.gaussians.means - state.gaussians.means, dim=1).numpy()
        step_m[weight] = step[going_on].mean(), step[~going_on].mean()
    assert step_m[1e3][0] < 0.2 * step_m[0.0][0]
    assert step_m[1e3][1] > 0.5 * step_m[0.0][1]


def test_no_steps_change_nothing(observations, state, quick_config) -> None:
    assert same(refine(observations, state, replace(quick_config, iterations=0), 0), state)


def test_batches_come_from_the_seed(observations, state, quick_config) -> None:
    first = refine(observations, state, quick_config, 0)
    assert same(first, refine(observations, state, quick_config, 0))
    assert not same(first, refine(observations, state, quick_config, 1))


class Stopped(Exception):
    """Stands for a process that ends in the middle of a frame."""


@pytest.mark.parametrize("objective", ["csi", "both"])
def test_a_resumed_descent_ends_where_an_undisturbed_one_does(
    tmp_path: Path, monkeypatch, observations, state, quick_config, objective
) -> None:
    monkeypatch.setattr(refine_module, "CHECKPOINT_EVERY", 5)
    config = replace(quick_config, iterations=12, objective=objective)
    undisturbed = refine(observations, state, config, 0)
    checkpoint = tmp_path / "frame.npz"
    steps = []

    def stop_after_seven(loss: float, _count: int) -> None:
        steps.append(loss)
        if len(steps) == 7:
            raise Stopped

    with pytest.raises(Stopped):
        refine(observations, state, config, 0, checkpoint, stop_after_seven)
    with np.load(checkpoint, allow_pickle=False) as stored:
        assert int(stored["finished_steps"]) == 5
    resumed = []
    # The start is read from the checkpoint, not from the arguments.
    other = replace(state, gaussians=state.gaussians.detach())
    other.gaussians.means += 1.0
    again = refine(observations, other, config, 0, checkpoint, lambda loss, _: resumed.append(loss))
    assert len(resumed) == 7
    assert resumed[:2] == steps[5:]
    assert same(again, undisturbed)


def test_density_control_resumes_exactly(
    tmp_path: Path, monkeypatch, observations, state, quick_config
) -> None:
    """Checkpoints fall on prunings, where the error window is empty."""
    # Half of the Gaussians agree with the encoder, so that the others can be pruned.
    state.gaussians.features[:6] = 0.0
    monkeypatch.setattr(refine_module, "CHECKPOINT_EVERY", 100)
    config = replace(quick_config, iterations=160, objective="paper", recipe="paper")
    counts: list[int] = []
    undisturbed = refine(
        observations, state, config, 0, on_step=lambda _, count: counts.append(count)
    )
    assert len(set(counts)) > 1
    checkpoint, steps = tmp_path / "frame.npz", []

    def stop(loss: float, _count: int) -> None:
        steps.append(loss)
        if len(steps) == 130:
            raise Stopped

    with pytest.raises(Stopped):
        refine(observations, state, config, 0, checkpoint, stop)
    again = refine(observations, state, config, 0, checkpoint)
    assert same(again, undisturbed)
    # Powers [m²] and tracks belong to the new rows.
    assert_shares(again, state)
    assert len(again.power) == len(again.track_id) == len(again.gaussians) == counts[-1]


@pytest.mark.parametrize("last", [49, 50, 99, 100])
def test_what_stopped_right_after_rows_changed_resumes_exactly(
    tmp_path: Path, monkeypatch, observations, state, quick_config, last: int
) -> None:
    """Every checkpoint of the paper's recipe falls on a pruning and a densification."""
    state.gaussians.features[:6] = 0.0
    monkeypatch.setattr(refine_module, "CHECKPOINT_EVERY", 1)
    config = replace(quick_config, iterations=101, objective="paper", recipe="paper")
    undisturbed = refine(observations, state, config, 0)
    steps: list[float] = []

    def stop(loss: float, _count: int) -> None:
        steps.append(loss)
        if len(steps) == last:
            raise Stopped

    with pytest.raises(Stopped):
        refine(observations, state, config, 0, tmp_path / "frame.npz", stop)
    resumed: list[float] = []
    again = refine(
        observations, state, config, 0, tmp_path / "frame.npz", lambda loss, _: resumed.append(loss)
    )
    assert len(resumed) == 101 - last and same(again, undisturbed)


def assert_shares(fitted: FrameState, start: FrameState) -> None:
    """Powers are shared by α ‖f‖², and together those of the start."""
    share = fitted.gaussians.features.norm(dim=1) ** 2 * fitted.gaussians.opacities
    torch.testing.assert_close(fitted.power, share / share.sum() * start.power.sum())


@pytest.mark.parametrize("density", ["paper", "none"])
def test_every_density_of_the_papers_losses_is_read_out_alike(
    observations, state, quick_config, density: Density
) -> None:
    config = replace(quick_config, objective="paper", recipe="paper", density=density)
    fitted = refine(observations, state, config, 0)
    assert_shares(fitted, state)
    assert fitted.power.std() > 0.0


def test_checkpoints_fall_on_prunings() -> None:
    """The error window is not saved: a checkpoint within one would forget it."""
    from rfgs_core.fit.density import DensityRule

    assert refine_module.CHECKPOINT_EVERY % DensityRule().prune_every == 0


def test_a_channel_that_is_not_a_number_is_refused(observations, state, quick_config) -> None:
    delta = observations.delta.copy()
    delta[:, :, 4] = np.nan
    broken = observations.with_delta(delta)
    with pytest.raises(RfgsError, match=r"became nan at step 1; .*validate.*no step .* was good"):
        refine(broken, state, quick_config, 0)


def test_the_last_finite_state_is_kept_when_the_loss_breaks(
    tmp_path: Path, monkeypatch, observations, state, quick_config
) -> None:
    """The features break after 14 steps; copies are made of the states after 0, 10, …"""
    checkpoint, finite = tmp_path / "frame.npz", refine_module.loss_of
    calls = []

    def breaks(task, state, gaussians, links, points):
        calls.append(1)
        if len(calls) == 15:
            with torch.no_grad():
                gaussians.features[3] = torch.inf
        return finite(task, state, gaussians, links, points)

    config = replace(quick_config, iterations=20)
    good = refine(observations, state, replace(config, iterations=10), 0)
    monkeypatch.setattr(refine_module, "loss_of", breaks)
    expected = r"at step 15; features of 1 Gaussians .*after 10 steps is kept in .*frame\.npz"
    with pytest.raises(RfgsError, match=expected):
        refine(observations, state, config, 0, checkpoint)
    with np.load(checkpoint, allow_pickle=False) as kept:
        assert int(kept["finished_steps"]) == 10
        np.testing.assert_array_equal(kept["means"], good.gaussians.means.numpy())
    # It can be gone on from.
    monkeypatch.setattr(refine_module, "loss_of", finite)
    again = refine(observations, state, config, 0, checkpoint)
    monkeypatch.undo()
    assert same(again, refine(observations, state, config, 0))


def test_a_damaged_checkpoint_says_what_to_do(
    tmp_path: Path, observations, state, quick_config
) -> None:
    checkpoint = tmp_path / "frame.npz"
    checkpoint.write_bytes(b"PK\x03\x04 cut short")
    with pytest.raises(RfgsError, match=r"frame\.npz.*delete it"):
        refine(observations, state, quick_config, 0, checkpoint)
