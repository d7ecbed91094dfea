# SPDX-License-Identifier: Apache-2.0
"""Rows of parameters and Adam's moments change only together, and survive a checkpoint."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.errors import RfgsFormatError
from rfgs_core.fit.parameters import LearningRates, TrainableGaussians
from rfgs_core.gaussians import Gaussians


def step(trained: TrainableGaussians, times: int = 1) -> None:
    """Adam steps whose gradients depend on every value."""
    for _ in range(times):
        loss = sum((torch.sin(3 * leaf) ** 2).sum() for leaf in trained.leaves.values())
        trained.optimiser.zero_grad()
        loss.backward()
        trained.optimiser.step()


@pytest.fixture
def trained(make_gaussians) -> TrainableGaussians:
    result = TrainableGaussians(make_gaussians(6), LearningRates())
    step(result, 3)
    return result


def copied(trained: TrainableGaussians) -> dict[str, np.ndarray]:
    return {name: value.copy() for name, value in trained.state().items()}


def test_default_rates_are_the_papers(make_gaussians) -> None:
    trained = TrainableGaussians(make_gaussians(2), LearningRates())
    rates = {name: trained.optimiser.rates[leaf] for name, leaf in trained.leaves.items()}
    assert rates == {
        "means": 0.005,
        "quats": 0.0005,
        "log_scales": 0.005,
        "logit_opacities": 0.005,
        "features": 0.0005,
    }


def test_the_given_gaussians_are_not_touched(make_gaussians) -> None:
    gaussians = make_gaussians(4)
    trained = TrainableGaussians(gaussians, LearningRates())
    step(trained)
    for name, value in make_gaussians(4).items():
        assert torch.equal(getattr(gaussians, name), value)
        assert not torch.equal(trained.leaves[name].detach(), value)


def test_the_layout_of_the_given_tensors_does_not_matter(make_gaussians) -> None:
    """A checkpoint holds values only, so the same values must step the same."""
    gaussians = make_gaussians(4)
    gaussians.features = gaussians.features.T.contiguous().T
    trained = TrainableGaussians(gaussians, LearningRates())
    step(trained, 2)
    assert all(value.is_contiguous() for value in trained.leaves.values())
    for state in trained.optimiser.state.values():
        assert state["exp_avg"].is_contiguous()


def test_kept_rows_keep_their_moments_and_new_ones_have_none(
    trained: TrainableGaussians, make_gaussians
) -> None:
    before = copied(trained)
    keep = torch.tensor([True, False, True, True, False, True])
    new = make_gaussians(2, seed=9)
    assert not trained.edited
    trained.edit_rows(keep, new)
    assert TrainableGaussians.restore(trained.state(), LearningRates()).edited
    after = copied(trained)
    for name, value in new.items():
        assert len(after[name]) == 6
        np.testing.assert_array_equal(after[name][:4], before[name][keep.numpy()])
        np.testing.assert_array_equal(after[name][4:], value)
        for moment in (f"{name}.exp_avg", f"{name}.exp_avg_sq"):
            assert np.abs(before[moment]).max() > 0
            np.testing.assert_array_equal(after[moment][:4], before[moment][keep.numpy()])
            assert (after[moment][4:] == 0).all()
        assert after[f"{name}.step"] == before[f"{name}.step"] == 3


def test_kept_rows_step_on_as_if_nothing_had_happened(trained: TrainableGaussians) -> None:
    other = TrainableGaussians.restore(copied(trained), LearningRates())
    keep = torch.tensor([True, False, True, True, False, True])
    trained.edit_rows(keep)
    step(trained, 2)
    step(other, 2)
    for name, value in trained.gaussians.items():
        assert torch.equal(value, getattr(other.gaussians, name)[keep])


def test_rows_can_be_edited_before_the_first_step(make_gaussians) -> None:
    trained = TrainableGaussians(make_gaussians(3), LearningRates())
    trained.edit_rows(torch.tensor([True, False, True]))
    step(trained)
    assert len(trained.gaussians) == 2


def test_a_restored_state_is_the_same_to_the_bit(trained: TrainableGaussians) -> None:
    other = TrainableGaussians.restore(copied(trained), LearningRates())
    first, second = copied(trained), copied(other)
    assert sorted(first) == sorted(second)
    assert len(first) == 5 * 4 + 2
    for name, value in first.items():
        np.testing.assert_array_equal(value, second[name])
        assert value.dtype == second[name].dtype
    step(trained, 2)
    step(other, 2)
    for name, value in trained.state().items():
        np.testing.assert_array_equal(value, other.state()[name])
    # And without the moments the next step would be another one.
    bare = {
        name: first[name]
        for name in ("edited", "origin", *(n for n, _ in Gaussians.none().items()))
    }
    forgetful = TrainableGaussians.restore(bare, LearningRates())
    step(forgetful, 2)
    assert not torch.equal(forgetful.leaves["means"], trained.leaves["means"])


def test_an_incomplete_checkpoint_is_refused(trained: TrainableGaussians) -> None:
    arrays = copied(trained)
    del arrays["quats"]
    with pytest.raises(RfgsFormatError, match="checkpoint without 'quats'"):
        TrainableGaussians.restore(arrays, LearningRates())
