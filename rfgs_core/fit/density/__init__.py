# SPDX-License-Identifier: Apache-2.0
"""Density control: which Gaussians come and go while the others are fitted."""

from rfgs_core.fit.density.paper import DensityRule, PaperDensity, frequency_gradient, redundant
from rfgs_core.fit.density.protocol import DensityControl, NoDensity
from rfgs_core.fit.density.residual import ResidualDensity, ResidualRule
from rfgs_core.fit.density.standard import StandardDensity, StandardRule

__all__ = [
    "DensityControl",
    "DensityRule",
    "NoDensity",
    "PaperDensity",
    "ResidualDensity",
    "ResidualRule",
    "StandardDensity",
    "StandardRule",
    "frequency_gradient",
    "redundant",
]
