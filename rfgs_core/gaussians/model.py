# SPDX-License-Identifier: Apache-2.0
"""The set of Gaussians and the quantities derived from it (paper section 3.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from rfgs_core.rotations import rotation_rows

#: Length of the radio feature each Gaussian carries (paper section 3.2).
FEATURE_DIM = 32


@dataclass
class Gaussians:
    """M Gaussians with radio features; rows of all fields belong together."""

    means: Float[Tensor, "M 3"]
    """Centres [m]."""
    quats: Float[Tensor, "M 4"]
    """World-from-Gaussian rotations, w first, not necessarily normalised."""
    log_scales: Float[Tensor, "M 3"]
    """Natural logarithm of the standard deviations [m]."""
    logit_opacities: Float[Tensor, "M"]
    """Logit of the opacity."""
    features: Float[Tensor, "M 32"]
    """Radio features."""

    def __len__(self) -> int:
        return int(self.means.shape[0])

    def items(self) -> Iterator[tuple[str, Tensor]]:
        """Pairs of field name and tensor, in the order of declaration."""
        for field in fields(self):
            yield field.name, getattr(self, field.name)

    @property
    def opacities(self) -> Float[Tensor, "M"]:
        """Opacities in (0, 1)."""
        return torch.sigmoid(self.logit_opacities)

    @property
    def scales(self) -> Float[Tensor, "M 3"]:
        """Standard deviations along the Gaussians' own axes [m]."""
        return torch.exp(self.log_scales)

    @property
    def rotations(self) -> Float[Tensor, "M 3 3"]:
        """Rotation matrices world_from_gaussian."""
        return rotation_matrices(self.quats)

    @property
    def covariances(self) -> Float[Tensor, "M 3 3"]:
        """Σ = R S Sᵀ Rᵀ [m²] (paper section 3.1)."""
        scaled = self.rotations * self.scales[:, None, :]
        return scaled @ scaled.transpose(1, 2)

    def select(self, rows: Bool[Tensor, "M"]) -> Gaussians:
        """The Gaussians of the marked rows."""
        return Gaussians(**{name: value[rows] for name, value in self.items()})

    def detach(self) -> Gaussians:
        """A copy that shares no memory and carries no gradient."""
        return Gaussians(**{name: value.detach().clone() for name, value in self.items()})

    @staticmethod
    def join(first: Gaussians, second: Gaussians) -> Gaussians:
        """Both sets, rows of `first` before rows of `second`."""
        return Gaussians(
            **{
                name: torch.cat([value, getattr(second, name)], dim=0)
                for name, value in first.items()
            }
        )

    @staticmethod
    def none() -> Gaussians:
        """The empty set."""
        return Gaussians(
            means=torch.zeros(0, 3),
            quats=torch.zeros(0, 4),
            log_scales=torch.zeros(0, 3),
            logit_opacities=torch.zeros(0),
            features=torch.zeros(0, FEATURE_DIM),
        )


def rotation_matrices(quats: Float[Tensor, "M 4"]) -> Float[Tensor, "M 3 3"]:
    """Rotation matrices of quaternions, w first, normalised here."""
    rows = rotation_rows(*torch.nn.functional.normalize(quats, dim=-1).unbind(-1))
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)
