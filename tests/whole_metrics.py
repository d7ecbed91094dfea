# SPDX-License-Identifier: Apache-2.0
"""Everything that the metrics of a run hold."""

from __future__ import annotations

from typing import Any

from rfgs_core.evaluate.metrics import SCHEMA


def whole_metrics(metrics: dict[str, Any] | None = None) -> dict[str, Any]:
    """Metrics with everything else that their file holds.

    Args:
        metrics: What is known: `geometry`, `rf`, `people` and `baselines` with the first two.
    """
    given = metrics or {
        "geometry": {"f05": 0.5, "f10": 0.6},
        "rf": {"element_snr_db": 3.0},
        "people": None,
        "baselines": {"clean": {"geometry": {"f05": None, "f10": 0.2}, "rf": {}}},
    }
    none: dict[str, Any] = {"rf_csi": {}, "image": {}}
    rows = {name: {**row, **none} for name, row in given["baselines"].items()}
    rest = {key: {} for key in ("conditions", "hardware", "versions", "reasons")}
    return {
        "schema": SCHEMA, **given, **none, **rest, "baselines": rows, "frames": [],
        "background": None, "limits": {"range_resolution_m": 0.9, "cross_range_m": 1.6},
        "trace_depth": 3, "n_gaussians": 40, "train_s": 1.0, "date": "", "verdicts": [],
    }  # fmt: skip
