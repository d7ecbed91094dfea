# SPDX-License-Identifier: Apache-2.0
"""The posterior mean against a dense solution, and known reflectivities found again."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rfgs_core.gaussians import Gaussians
from rfgs_core.model.channel import Channel
from rfgs_core.model.head import RadioHead
from rfgs_core.model.reflectivity import posterior_mean


@pytest.fixture
def head() -> RadioHead:
    return RadioHead.create(0, 0.0517, 0.04, 0.02)


@pytest.fixture
def channel(make_observations) -> Channel:
    subcarriers = np.ones(32, bool)
    subcarriers[20:24] = False
    observations = make_observations(subcarriers=subcarriers)
    return Channel.of(observations, observations.links, subcarriers)


def complex_normal(*size: int, seed: int = 0) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*size, dtype=torch.complex64, generator=generator)


def dense(channel: Channel, head: RadioHead, gaussians: Gaussians) -> np.ndarray:
    """The channel of unit reflectivities, (link · subcarrier, Gaussian)."""
    columns = []
    for index in range(len(gaussians)):
        gamma = torch.zeros(len(gaussians), dtype=torch.complex64)
        gamma[index] = 1.0
        columns.append(channel.scattered(head, gaussians, gamma).numpy().ravel())
    return np.stack(columns, axis=1).astype(np.complex128)


def test_the_gradient_is_the_adjoint(channel, head, make_gaussians) -> None:
    gaussians = make_gaussians(15)
    x = complex_normal(15)
    y = complex_normal(256, 28, seed=1)
    zero = torch.zeros(15, dtype=torch.complex64, requires_grad=True)
    (adjoint,) = torch.autograd.grad(channel.scattered(head, gaussians, zero), zero, y)
    forward = channel.scattered(head, gaussians, x)
    left = torch.vdot(y.ravel().cdouble(), forward.ravel().cdouble())
    right = torch.vdot(adjoint.cdouble(), x.cdouble())
    size = torch.linalg.norm(forward.cdouble()) * torch.linalg.norm(y.cdouble())
    assert abs(left - right) < 1e-5 * size
    assert abs(left) > 1e-4 * size


def test_posterior_mean_is_the_dense_solution(channel, head, make_gaussians) -> None:
    """(A^H N^-1 A + P^-1)^-1 A^H N^-1 y with unequal noise and prior."""
    gaussians = make_gaussians(6)
    matrix = dense(channel, head, gaussians)
    y = complex_normal(256, 28, seed=2) * float(np.abs(matrix).mean())
    rng = np.random.default_rng(0)
    level = float((np.abs(matrix) ** 2).mean())
    noise = rng.uniform(0.5, 2, 256) * level * 5000
    power = rng.uniform(0.2, 5, 6)
    weight = np.repeat(1 / noise, 28)
    normal = matrix.conj().T @ (weight[:, None] * matrix) + np.diag(1 / power)
    expected = np.linalg.solve(normal, matrix.conj().T @ (weight * y.numpy().ravel()))
    got = posterior_mean(
        *(channel, head, gaussians, y),
        *(torch.from_numpy(noise).float(), torch.from_numpy(power).float()),
        iterations=12,
    )
    error = np.linalg.norm(got.numpy() - expected) / np.linalg.norm(expected)
    assert error < 1e-3
    # The prior matters here: without it the answer is another one.
    free = np.linalg.lstsq(
        np.sqrt(weight)[:, None] * matrix, np.sqrt(weight) * y.numpy().ravel(), rcond=None
    )[0]
    assert np.linalg.norm(free - expected) > 0.05 * np.linalg.norm(expected)


def test_known_reflectivities_are_found_again(channel, head) -> None:
    """A few Gaussians half a metre apart, noise far below their own channel."""
    means = torch.tensor([[1.2, 1.0, 0.8], [2.0, 2.2, 1.2], [2.8, 1.2, 1.6], [1.6, 1.7, 0.4]])
    upright = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(4, 1)
    gaussians = Gaussians(
        means=means,
        quats=upright,
        log_scales=torch.full((4, 3), -4.0),
        logit_opacities=torch.zeros(4),
        features=torch.zeros(4, 32),
    )
    gamma = torch.tensor([0.02 + 0.01j, -0.015j, 0.03 + 0j, -0.02 + 0.02j])
    target = channel.scattered(head, gaussians, gamma)
    noise = torch.full((256,), 1e-6 * float((target.abs() ** 2).mean()))
    power = gamma.abs() ** 2
    got = posterior_mean(channel, head, gaussians, target, noise, power, iterations=20)
    assert ((got - gamma).abs() < 0.01 * gamma.abs()).all()


def test_silence_and_distrust_give_nothing(channel, head, make_gaussians) -> None:
    gaussians = make_gaussians(5)
    noise, power = torch.ones(256), torch.ones(5)
    nothing = torch.zeros(256, 28, dtype=torch.complex64)
    got = posterior_mean(channel, head, gaussians, nothing, noise, power, iterations=5)
    assert (got == 0).all()
    target = channel.scattered(head, gaussians, complex_normal(5))
    huge = torch.full((256,), 1e12)
    got = posterior_mean(channel, head, gaussians, target, huge, power, iterations=5)
    assert got.abs().max() < 1e-6
