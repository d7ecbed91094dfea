# SPDX-License-Identifier: Apache-2.0
"""Evaluation: what a sceptic would ask, with every number beside its baselines."""

from __future__ import annotations

from rfgs_core.evaluate.grid import Grid, splat_gaussians

__all__ = ["Grid", "splat_gaussians"]
