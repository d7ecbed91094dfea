# SPDX-License-Identifier: Apache-2.0
"""Adam without the start of torch's compiler."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import torch
from torch import Tensor
from torch.optim.adam import adam


class Adam:
    """`torch.optim.Adam`, or `AdamW` where weights decay, each tensor with a rate of its own.

    Steps are those of the function below torch's classes, to the bit; on a GPU one kernel takes all
    tensors of a rate, as `fused` ones there do. The classes themselves import
    `torch._dynamo` when one is first made, which takes a process two seconds of processor time.
    """

    def __init__(
        self, rates: Mapping[Tensor, float], *, eps: float = 1e-8, decay: float = 0.0
    ) -> None:
        """Remembers nothing yet.

        Args:
            rates: Learning rate of each leaf tensor.
            eps: What is added to the root of the second moment.
            decay: Share of the rate by which weights shrink in each step, as in `AdamW`.
        """
        self.rates = dict(rates)
        self.eps, self.decay = eps, decay
        #: What it remembers of each tensor that has stepped: `step`, `exp_avg` and `exp_avg_sq`.
        self.state: dict[Tensor, dict[str, Tensor]] = {}

    @staticmethod
    def of(leaves: Iterable[Tensor], rate: float, *, eps: float = 1e-8, decay: float = 0.0) -> Adam:
        """All tensors at one rate."""
        return Adam(dict.fromkeys(leaves, rate), eps=eps, decay=decay)

    def set_rate(self, rate: float) -> None:
        """Gives all tensors one rate from here on."""
        self.rates = dict.fromkeys(self.rates, rate)

    def zero_grad(self) -> None:
        """Drops the gradients."""
        for leaf in self.rates:
            leaf.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Moves every tensor that has a gradient."""
        moving = [leaf for leaf in self.rates if leaf.grad is not None]
        for leaf in moving:
            if leaf not in self.state:
                moments = {key: torch.zeros_like(leaf) for key in ("exp_avg", "exp_avg_sq")}
                self.state[leaf] = {**moments, "step": torch.zeros((), device=leaf.device)}
        for rate in {self.rates[leaf] for leaf in moving}:
            leaves = [leaf for leaf in moving if self.rates[leaf] == rate]
            states = [self.state[leaf] for leaf in leaves]
            adam(
                leaves,
                [leaf.grad for leaf in leaves if leaf.grad is not None],
                [state["exp_avg"] for state in states],
                [state["exp_avg_sq"] for state in states],
                [],
                [state["step"] for state in states],
                fused=leaves[0].is_cuda,
                amsgrad=False,
                beta1=0.9,
                beta2=0.999,
                lr=rate,
                weight_decay=self.decay,
                decoupled_weight_decay=True,
                eps=self.eps,
                maximize=False,
            )
