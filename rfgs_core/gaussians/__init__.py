# SPDX-License-Identifier: Apache-2.0
"""Radio Gaussians: what a scene is made of after training."""

from __future__ import annotations

from rfgs_core.gaussians.model import FEATURE_DIM, Gaussians

__all__ = ["FEATURE_DIM", "Gaussians"]
