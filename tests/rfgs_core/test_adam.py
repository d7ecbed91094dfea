# SPDX-License-Identifier: Apache-2.0
"""Adam beside torch's class, and what it leaves unimported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import torch

from rfgs_core.adam import Adam

Make = Callable[[dict[torch.Tensor, float]], Any]


def descend(
    make: Make,
    before_step: Callable[[Any, int], None] = lambda optimiser, step: None,
    device: str = "cpu",
) -> list[torch.Tensor]:
    """Where two tensors go, the second without a gradient in the second step."""
    generator = torch.Generator().manual_seed(1)
    first = [torch.randn(4, 3, generator=generator).to(device) for _ in range(2)]
    leaves = [value.requires_grad_() for value in first]
    optimiser = make(dict(zip(leaves, (0.1, 0.003), strict=True)))
    for step, moving in enumerate((2, 1, 2)):
        before_step(optimiser, step)
        loss = torch.stack([(torch.sin(3 * leaf) ** 2).sum() for leaf in leaves[:moving]]).sum()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    remembered = [optimiser.state[leaf] for leaf in leaves]
    return leaves + [state[key] for state in remembered for key in sorted(state)]


def of_torch(rates: dict[torch.Tensor, float]) -> torch.optim.Adam:
    return torch.optim.Adam([{"params": [leaf], "lr": rate} for leaf, rate in rates.items()])


def test_steps_and_moments_are_those_of_torchs_class_to_the_bit() -> None:
    for ours, theirs in zip(descend(Adam), descend(of_torch), strict=True):
        assert torch.equal(ours, theirs)


def test_an_eps_and_a_rate_that_falls_are_torchs_too() -> None:
    def torchs(optimiser: torch.optim.Adam, step: int) -> None:
        optimiser.param_groups[0]["lr"] = 0.1 / (1 + step)

    ours = descend(
        lambda rates: Adam.of(rates, 0.1, eps=1e-3),
        lambda optimiser, step: optimiser.set_rate(0.1 / (1 + step)),
    )
    theirs = descend(lambda rates: torch.optim.Adam(list(rates), 0.1, eps=1e-3), torchs)
    assert all(torch.equal(a, b) for a, b in zip(ours, theirs, strict=True))


def test_weights_decay_as_those_of_torchs_adamw() -> None:
    ours = descend(lambda rates: Adam.of(rates, 0.1, decay=0.02))
    theirs = descend(lambda rates: torch.optim.AdamW(list(rates), 0.1, weight_decay=0.02))
    assert all(torch.equal(a, b) for a, b in zip(ours, theirs, strict=True))


def test_a_step_leaves_torchs_compiler_unimported(python) -> None:
    steps = (
        "import sys, torch; from rfgs_core.adam import Adam",
        "leaf = torch.ones(2, requires_grad=True)",
        "optimiser = Adam({leaf: 0.1}); leaf.sum().backward(); optimiser.step()",
        "assert leaf[0] < 1 and 'torch._dynamo' not in sys.modules",
    )
    python("-c", "; ".join(steps), must_work=True)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_a_gpu_steps_as_the_processor_does() -> None:
    places = [
        descend(lambda rates: Adam(rates, decay=0.02), device=device) for device in ("cpu", "cuda")
    ]
    for ours, theirs in zip(*places, strict=True):
        torch.testing.assert_close(ours, theirs.cpu(), atol=1e-6, rtol=1e-5)
