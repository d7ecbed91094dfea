# SPDX-License-Identifier: Apache-2.0
"""Adam for a few tensors, without the start of torch's compiler."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor
from torch.optim.adam import adam


class Adam:
    """`torch.optim.Adam` at its defaults, each tensor with a rate of its own.

    Steps are those of the function below torch's class, to the bit. The class itself imports
    `torch._dynamo` when it is first made, which takes a process a second of processor time.
    """

    def __init__(self, rates: Mapping[Tensor, float]) -> None:
        """`rates` is the learning rate of each leaf tensor."""
        self.rates = dict(rates)
        #: What it remembers of each tensor that has stepped: `step`, `exp_avg` and `exp_avg_sq`.
        self.state: dict[Tensor, dict[str, Tensor]] = {}

    def zero_grad(self) -> None:
        """Drops the gradients."""
        for leaf in self.rates:
            leaf.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Moves every tensor that has a gradient."""
        for leaf, rate in self.rates.items():
            if leaf.grad is None:
                continue
            if leaf not in self.state:
                moments = {key: torch.zeros_like(leaf) for key in ("exp_avg", "exp_avg_sq")}
                # Steps are counted on the CPU wherever the tensor is, as torch does.
                self.state[leaf] = {**moments, "step": torch.tensor(0.0)}
            state = self.state[leaf]
            adam(
                [leaf],
                [leaf.grad],
                [state["exp_avg"]],
                [state["exp_avg_sq"]],
                [],
                [state["step"]],
                amsgrad=False,
                beta1=0.9,
                beta2=0.999,
                lr=rate,
                weight_decay=0.0,
                eps=1e-8,
                maximize=False,
            )
