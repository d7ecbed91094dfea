# SPDX-License-Identifier: Apache-2.0
"""Trainable Gaussians and their Adam state, which change rows only together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from rfgs_core.adam import Adam
from rfgs_core.arrays import Shape
from rfgs_core.device import on_device
from rfgs_core.errors import RfgsFormatError
from rfgs_core.gaussians import Gaussians

#: Shapes of the arrays of Gaussians in a file.
GAUSSIAN_SHAPES: dict[str, Shape] = {
    name: ("M", *value.shape[1:]) for name, value in Gaussians.none().items()
}

MOMENTS = ("exp_avg", "exp_avg_sq")
_KEPT = (*MOMENTS, "step")


@dataclass(frozen=True)
class LearningRates:
    """Adam learning rates; the defaults are the paper's (section 3.6)."""

    means: float = 0.005
    """Positions [m per step]."""
    log_scales: float = 0.005
    """Logarithm of the scales."""
    quats: float = 0.0005
    """Rotations."""
    features: float = 0.0005
    """Radio features."""
    logit_opacities: float = 0.005
    """Opacities; the paper names no rate, this is that of the scales."""


class TrainableGaussians:
    """Gaussians as leaf tensors with one Adam optimiser over all of them."""

    def __init__(self, gaussians: Gaussians, rates: LearningRates) -> None:
        self.rates = rates
        #: Row at the start that each Gaussian is or stems from; −1: none.
        self.origin = torch.arange(len(gaussians), device=gaussians.means.device)
        #: Whether rows have come or gone since the start.
        self.edited = False
        # Row-major whatever came: kernels round differently on another layout, and a checkpoint
        # would not bring that layout back.
        layout = torch.contiguous_format
        self._adopt(
            {name: value.detach().clone(memory_format=layout) for name, value in gaussians.items()}
        )

    def _adopt(self, values: dict[str, Tensor]) -> None:
        self.leaves = {name: value.requires_grad_(True) for name, value in values.items()}
        self.optimiser = Adam(
            {leaf: getattr(self.rates, name) for name, leaf in self.leaves.items()}
        )

    @property
    def device(self) -> torch.device:
        """Where the Gaussians are."""
        return self.origin.device

    @property
    def gaussians(self) -> Gaussians:
        """The Gaussians; gradients flow into the leaves."""
        return Gaussians(**self.leaves)

    def edit_rows(
        self,
        keep: Bool[Tensor, "M"],
        new: Gaussians | None = None,
        *,
        parents: Int64[Tensor, "N"] | None = None,
        replaced: Mapping[str, Tensor] | None = None,
    ) -> None:
        """Drops rows, appends and overwrites, in the parameters and in Adam's moments alike.

        Args:
            keep: Rows that stay.
            new: Rows that come; their moments are zero.
            parents: Present row that each new one stems from; None: they stem from none.
            replaced: New values of whole parameters, a row for each of the present ones; the
                moments of these parameters start over.
        """
        if new is not None or not bool(keep.all()):
            self.edited = True
        old = {name: self.optimiser.state.get(leaf, {}) for name, leaf in self.leaves.items()}
        added = dict(on_device(new or Gaussians.none(), self.device).items())
        count = len(added["means"])
        stems = self.origin.new_full((count,), -1) if parents is None else self.origin[parents]
        self.origin = torch.cat([self.origin[keep], stems])
        values = {name: leaf.detach() for name, leaf in self.leaves.items()} | dict(replaced or {})
        self._adopt(
            {name: torch.cat([value[keep], added[name].detach()]) for name, value in values.items()}
        )
        for name, leaf in self.leaves.items():
            if old[name]:
                kept = 0.0 if name in (replaced or {}) else 1.0
                self.optimiser.state[leaf] = {
                    "step": old[name]["step"],
                    **{
                        key: torch.cat([old[name][key][keep] * kept, torch.zeros_like(added[name])])
                        for key in MOMENTS
                    },
                }

    def state(self) -> dict[str, np.ndarray]:
        """Parameters and moments as arrays, for a checkpoint without pickle."""
        arrays = {"edited": np.array(self.edited), "origin": self.origin.cpu().numpy()}
        for name, leaf in self.leaves.items():
            arrays[name] = leaf.detach().cpu().numpy()
            state = self.optimiser.state.get(leaf, {})
            for key in _KEPT if state else ():
                arrays[f"{name}.{key}"] = state[key].cpu().numpy()
        return arrays

    @staticmethod
    def restore(
        arrays: dict[str, np.ndarray],
        rates: LearningRates,
        device: torch.device | str = "cpu",
    ) -> TrainableGaussians:
        """Rebuilds what `state` returned, bit for bit.

        Raises:
            RfgsFormatError: An array is missing, or a moment does not fit its parameter.
        """
        try:
            fields = {name: torch.from_numpy(arrays[name].copy()) for name in GAUSSIAN_SHAPES}
            result = TrainableGaussians(on_device(Gaussians(**fields), device), rates)
            result.edited = bool(arrays["edited"])
            result.origin = torch.from_numpy(arrays["origin"].copy()).to(device)
            for name, leaf in result.leaves.items():
                if f"{name}.step" in arrays:
                    kept = {key: torch.from_numpy(arrays[f"{name}.{key}"].copy()) for key in _KEPT}
                    result.optimiser.state[leaf] = {
                        key: value.to(device) for key, value in kept.items()
                    }
                    if any(
                        result.optimiser.state[leaf][key].shape != leaf.shape for key in MOMENTS
                    ):
                        raise RfgsFormatError(
                            f"checkpoint whose moments of {name} have another shape than "
                            f"{tuple(leaf.shape)}; delete it to start over"
                        )
        except KeyError as error:
            raise RfgsFormatError(f"checkpoint without {error}; delete it to start over") from error
        return result
