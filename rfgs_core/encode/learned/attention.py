# SPDX-License-Identifier: Apache-2.0
"""Learnable spatial attention: at each point, how much each feature listens to each device pair.

Every feature has a head of its own. Over a narrow band all windows hear nearly the same; what
then tells features apart is whom they listen to.
"""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

from rfgs_core.encode.protocol import FEATURES

#: Added to powers before their logarithm; pairs have a mean power of one per entry.
_FLOOR = 1e-3
_HIDDEN = 32


class PairAttention(nn.Module):
    """Weights of device pairs from what each says at a point and how far away it stands."""

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Linear(FEATURES + 2, _HIDDEN)
        self.last = nn.Linear(_HIDDEN, FEATURES)
        nn.init.normal_(self.last.weight)

    def forward(
        self, power: Float[Tensor, "pair N 32"], legs_m: Float[Tensor, "pair N 2"]
    ) -> Float[Tensor, "N 32"]:
        """Root of the attended mean power over pairs; untrained, heads differ at random.

        Args:
            power: |y|² of each pair, point and feature.
            legs_m: Distances from the transmitting and the receiving device [m].
        """
        tokens = torch.cat([torch.log(power + _FLOOR), torch.log(legs_m + _FLOOR)], dim=-1)
        score = self.last(torch.relu(self.first(tokens)))
        weight = torch.softmax(score, dim=0)
        # The root has no slope at zero.
        return torch.sqrt((weight * power).sum(dim=0) + 1e-12)
