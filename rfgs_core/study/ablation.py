# SPDX-License-Identifier: Apache-2.0
"""Variants of the paper's ablation (its table 2), all from our start."""

from __future__ import annotations

from dataclasses import dataclass

from rfgs_core.settings import Density, Part


@dataclass(frozen=True)
class Variant:
    """One row of the ablation."""

    name: str
    """What its method is called by."""
    label: str
    """The paper's words."""
    claimed_db: float
    """Picture PSNR that the paper claims; nobody has reproduced it."""
    without: tuple[Part, ...] = ()
    """Parts that are left out."""
    density: Density | None = None
    """How Gaussians come and go; None: as the paper says."""

    @property
    def method(self) -> str:
        """Its name in the paper's tables."""
        return "paper_prior" if self.name == "full" else f"paper_{self.name}"


VARIANTS = (
    Variant("full", "full", 33.7),
    Variant("no_weights", "w/o RF-weighted loss", 28.3, without=("rf_weights",)),
    Variant("no_densify", "w/o adaptive densify", 30.1, without=("densify",)),
    Variant("no_gradients", "w/o feature gradients", 29.8, without=("feature_gradients",)),
    Variant("no_pruning", "w/o pruning", 31.2, without=("prune",)),
    Variant("fixed", "fixed density", 26.9, density="none"),
    Variant("standard", "standard 3DGS densify", 24.1, density="3dgs"),
)
