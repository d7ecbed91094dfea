# SPDX-License-Identifier: Apache-2.0
"""Baselines: what anybody could do with the same evidence. Every table shows all of them."""

from __future__ import annotations

from functools import partial

from rfgs_core.evaluate.baselines import (
    body_prior,
    clean,
    fista,
    gaussian_process,
    matched_filter,
    music,
    nonnegative,
    omp,
    plain,
    spectrum,
    template,
)
from rfgs_core.evaluate.baselines.matched_filter import variant
from rfgs_core.evaluate.evidence import Baseline, BaselineResult, Evidence

#: Baselines that look at one frame's evidence, by the name they have in `metrics.json`.
BASELINES: dict[str, Baseline] = {
    "zero": plain.zero,
    "nearest_element": plain.nearest_element,
    "linear": plain.lines,
    "gaussian_process": gaussian_process.baseline,
    "spectrum": spectrum.baseline,
    "empty_room": plain.empty_room,
    "matched_filter": matched_filter.baseline,
    "matched_filter_all_sum": partial(variant, different_only=False, log_mean=False),
    "matched_filter_all_log_mean": partial(variant, different_only=False, log_mean=True),
    "matched_filter_different_sum": partial(variant, different_only=True, log_mean=False),
    "matched_filter_different_log_mean": partial(variant, different_only=True, log_mean=True),
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
