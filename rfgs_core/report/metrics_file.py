# SPDX-License-Identifier: Apache-2.0
"""`metrics.json` as reports and studies read it; it may hold more than is named here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec import Struct

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.metrics import SCHEMA
from rfgs_core.records import record
from rfgs_core.seals import read_sealed_json

#: Values by name; None where there is none, for a reason.
Values = dict[str, float | None]


class _Groups(Struct):
    """Values of the method or of a baseline."""

    geometry: Values
    rf: Values
    rf_csi: Values
    image: Values


class _FrameGroups(Struct):
    geometry: Values = {}
    rf: Values = {}
    rf_csi: Values = {}


class _Frame(Struct):
    frame: int
    geometry: Values
    baselines: dict[str, _FrameGroups]


class _Background(Struct):
    n_gaussians: int
    rows: dict[str, Values]
    surface_m: dict[str, float] | None


class _Limits(Struct):
    range_resolution_m: float | None
    cross_range_m: float | None


class _Metrics(_Groups):
    baselines: dict[str, _Groups]
    frames: list[_Frame]
    people: Values | None
    background: _Background | None
    limits: _Limits
    trace_depth: int
    n_gaussians: int
    train_s: float
    conditions: dict[str, str | int | float | bool | None]
    hardware: dict[str, str | int | float | None]
    versions: dict[str, str | None]
    date: str
    reasons: dict[str, str]
    verdicts: list[str]


def read_metrics(run: Path) -> dict[str, Any]:
    """Metrics of a run.

    Raises:
        RfgsError: The folder is no run, or it has not been evaluated.
        RfgsFormatError: The metrics are damaged or of another version.
    """
    file = run / "metrics.json"
    if not (run / "config.json").is_file():
        raise RfgsError(f"{run}: not a run; expected a folder with config.json")
    if not file.is_file():
        raise RfgsError(f"{run}: not evaluated yet; run `rfgs eval {run}` first")
    remedy = f"run `rfgs eval {run}` again"
    metrics = read_sealed_json(file, remedy)
    if metrics.get("schema") != SCHEMA:
        raise RfgsFormatError(f"{file}: expected schema {SCHEMA}; {remedy}")
    record(file, metrics, _Metrics, remedy)
    return metrics
