# SPDX-License-Identifier: Apache-2.0
"""Adam beside torch's class, and what it leaves unimported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch

from rfgs_core.adam import Adam


def descend(make: Callable[[dict[torch.Tensor, float]], Any]) -> list[torch.Tensor]:
    """Where two tensors go, the second without a gradient in the second step."""
    generator = torch.Generator().manual_seed(1)
    leaves = [torch.randn(4, 3, generator=generator).requires_grad_() for _ in range(2)]
    optimiser = make(dict(zip(leaves, (0.1, 0.003), strict=True)))
    for moving in (2, 1, 2):
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


def test_a_step_leaves_torchs_compiler_unimported(python) -> None:
    steps = (
        "import sys, torch; from rfgs_core.adam import Adam",
        "leaf = torch.ones(2, requires_grad=True)",
        "optimiser = Adam({leaf: 0.1}); leaf.sum().backward(); optimiser.step()",
        "assert leaf[0] < 1 and 'torch._dynamo' not in sys.modules",
    )
    python("-c", "; ".join(steps), must_work=True)
