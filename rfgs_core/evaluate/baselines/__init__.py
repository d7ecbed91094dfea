# SPDX-License-Identifier: Apache-2.0
"""Controls: what anybody could do with the same evidence. Every table shows all of them."""

from __future__ import annotations

from rfgs_core.evaluate.baselines import (
    body_prior,
    clean,
    empty_room,
    gaussian_process,
    linear,
    matched_filter,
    nearest_element,
    omp,
    spectrum,
    template,
    zero,
)
from rfgs_core.evaluate.evidence import Control, ControlResult, Evidence

#: Controls that look at one frame's evidence, by the name they have in `metrics.json`.
CONTROLS: dict[str, Control] = {
    "zero": zero.control,
    "nearest_element": nearest_element.control,
    "linear": linear.control,
    "gaussian_process": gaussian_process.control,
    "spectrum": spectrum.control,
    "empty_room": empty_room.control,
    "matched_filter": matched_filter.control,
    "matched_filter_all_sum": matched_filter.all_sum,
    "matched_filter_all_log_mean": matched_filter.all_log_mean,
    "matched_filter_different_sum": matched_filter.different_sum,
    "matched_filter_different_log_mean": matched_filter.different_log_mean,
    "clean": clean.control,
    "omp": omp.control,
    "template": template.control,
    "template_filled": template.filled,
    "body_prior": body_prior.control,
}

__all__ = ["CONTROLS", "Control", "ControlResult", "Evidence"]
