# SPDX-License-Identifier: Apache-2.0
"""Baselines: what anybody could do with the same evidence. Every table shows all of them."""

from __future__ import annotations

from rfgs_core.evaluate.baselines import (
    body_prior,
    clean,
    empty_room,
    fista,
    gaussian_process,
    linear,
    matched_filter,
    music,
    nearest_element,
    nonnegative,
    omp,
    spectrum,
    template,
    zero,
)
from rfgs_core.evaluate.evidence import Baseline, BaselineResult, Evidence

#: Baselines that look at one frame's evidence, by the name they have in `metrics.json`.
BASELINES: dict[str, Baseline] = {
    "zero": zero.baseline,
    "nearest_element": nearest_element.baseline,
    "linear": linear.baseline,
    "gaussian_process": gaussian_process.baseline,
    "spectrum": spectrum.baseline,
    "empty_room": empty_room.baseline,
    "matched_filter": matched_filter.baseline,
    "matched_filter_all_sum": matched_filter.all_sum,
    "matched_filter_all_log_mean": matched_filter.all_log_mean,
    "matched_filter_different_sum": matched_filter.different_sum,
    "matched_filter_different_log_mean": matched_filter.different_log_mean,
    "clean": clean.baseline,
    "omp": omp.baseline,
    "fista": fista.baseline,
    "nnls": nonnegative.baseline,
    "music": music.baseline,
    "template": template.baseline,
    "template_filled": template.filled,
    "body_prior": body_prior.baseline,
}

__all__ = ["BASELINES", "Baseline", "BaselineResult", "Evidence"]
