# SPDX-License-Identifier: Apache-2.0
"""What the metrics of a study's cases say together: means over seeds, and targets set before."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.study.cases import Case

#: Baselines whose best F10 the method's is held against.
IMAGES = ("matched_filter", "clean", "omp", "fista", "nnls", "music")
#: Share of the best image's error 1 − F10 that is to be cut, or of its gap to the ceiling closed.
CUT_TARGET = {"wifi": 0.5, "mmwave": 0.4, "uwb": 0.4}
#: Largest distance between a person's true centroid and that of the body found [m].
CENTROID_TARGET_M = {"wifi": 0.25, "mmwave": 0.10, "uwb": 0.10}
#: F-scores in which the template is to be beaten.
TEMPLATE_TARGETS = {"wifi": ("f10",), "mmwave": ("f05", "f10"), "uwb": ("f05", "f10")}
#: Least share of people whose body's centroid is within half a metre.
FOUND_TARGET = 0.95
#: Decibels above linear interpolation that held-out elements are to reach.
ELEMENT_TARGET_DB = 6.0
#: Baselines that only interpolate the channel.
INTERPOLATORS = ("linear", "gaussian_process", "spectrum")

_OWN = ("f05", "f10")
_PEOPLE = ("centroid_m", "found", "identity_kept")


@dataclass(frozen=True)
class Row:
    """One scene, condition and radio: means over its seeds."""

    scene: str
    condition: str
    radio: str
    seeds: int
    """Seeds that are finished."""
    values: dict[str, float | None]
    """Means by name; None where no seed has a value."""
    spread_f10: float
    """Largest less smallest F10 over the seeds."""
    best_image: str
    """Which of `IMAGES` has the best F10."""
    best_gain: str
    """Which baseline has the least error of an unseen device pair's level; empty for none."""
    best_profile: str
    """Which baseline has the best delay profiles of unseen links; empty for none."""
    targets: dict[str, bool | None]
    """Whether each target is reached; None where it cannot be told."""


def summarise(results: Iterable[tuple[Case, Mapping[str, Any]]]) -> list[Row]:
    """Groups finished cases by scene, condition and radio, in the order they come in.

    Args:
        results: Cases and their `metrics.json`.
    """
    groups: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for case, metrics in results:
        groups.setdefault((case.scene, case.condition, case.radio), []).append(metrics)
    return [_row(*names, rows) for names, rows in groups.items()]


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _baseline(rows: list[Mapping[str, Any]], name: str, group: str, key: str) -> float | None:
    return _mean(((row["baselines"].get(name) or {}).get(group) or {}).get(key) for row in rows)


def _row(scene: str, condition: str, radio: str, rows: list[Mapping[str, Any]]) -> Row:
    values = {key: _mean(row["geometry"].get(key) for row in rows) for key in _OWN}
    for key in _PEOPLE:
        values[key] = _mean((row.get("people") or {}).get(key) for row in rows)
    of_images = {name: _baseline(rows, name, "geometry", "f10") for name in IMAGES}
    best_image = max(IMAGES, key=lambda name: of_images[name] or 0.0)
    values["image_f10"] = of_images[best_image]
    values["oracle_f10"] = _baseline(rows, "oracle_init", "geometry", "f10")
    for key in ("f05", "f10"):
        values[f"template_{key}"] = _baseline(rows, "template", "geometry", key)
    values["prior_f10"] = _baseline(rows, "body_prior", "geometry", "f10")
    values["cut"] = _share(values["f10"], values["image_f10"], 1.0)
    values["gap"] = _share(values["f10"], values["image_f10"], values["oracle_f10"])
    values["element_snr_db"] = _mean(row["rf"].get("element_snr_db") for row in rows)
    for name in INTERPOLATORS:
        values[f"{name}_snr_db"] = _baseline(rows, name, "rf", "element_snr_db")
    for key in ("device_gain_mae_db", "delay_profile_corr"):
        values[key] = _mean(row["rf"].get(key) for row in rows)
    best_gain, values["baseline_device_gain_mae_db"] = _best_channel(
        rows, "device_gain_mae_db", min
    )
    best_corr, values["baseline_delay_profile_corr"] = _best_channel(
        rows, "delay_profile_corr", max
    )
    f10 = [row["geometry"]["f10"] for row in rows if row["geometry"].get("f10") is not None]
    spread = max(f10) - min(f10) if f10 else 0.0
    return Row(
        scene=scene,
        condition=condition,
        radio=radio,
        seeds=len(rows),
        values=values,
        spread_f10=spread,
        best_image=best_image,
        best_gain=best_gain,
        best_profile=best_corr,
        targets=_targets(radio, values),
    )


def _best_channel(
    rows: list[Mapping[str, Any]], key: str, best: Callable[..., str]
) -> tuple[str, float | None]:
    """Which baseline is best in a metric of unseen links, and its mean."""
    names = [name for name in rows[0]["baselines"] if name not in (GAUSSIANS_ALONE, "oracle_init")]
    found = {name: _baseline(rows, name, "rf", key) for name in names}
    known = {name: value for name, value in found.items() if value is not None}
    name = best(known, key=lambda name: known[name], default="")
    return name, known.get(name)


def _share(own: float | None, image: float | None, ceiling: float | None) -> float | None:
    """How far from the image's score to the ceiling; None without room between the two."""
    if own is None or image is None or ceiling is None or ceiling <= image:
        return None
    return (own - image) / (ceiling - image)


def _targets(radio: str, values: Mapping[str, float | None]) -> dict[str, bool | None]:
    """The targets, each reached or not."""

    def above(name: str, target: float | None) -> bool | None:
        value = values[name]
        return None if value is None or target is None else value > target

    def better(name: str, baseline: str, lead: float) -> bool | None:
        other = values[baseline]
        return above(name, None if other is None else other + lead)

    kept = values["identity_kept"]
    shares = [share for share in (values["cut"], values["gap"]) if share is not None]
    return {
        "cut": max(shares) >= CUT_TARGET[radio] if shares else None,
        **{
            f"template_{key}": better(key, f"template_{key}", 0.0)
            for key in TEMPLATE_TARGETS[radio]
        },
        "centroid": _less(values["centroid_m"], CENTROID_TARGET_M[radio]),
        "found": above("found", FOUND_TARGET),
        "identity": None if kept is None else kept == 1.0,
        "linear": better("element_snr_db", "linear_snr_db", ELEMENT_TARGET_DB),
        "gaussian_process": better("element_snr_db", "gaussian_process_snr_db", 0.0),
        "pair_gain": _less(values["device_gain_mae_db"], values["baseline_device_gain_mae_db"]),
        "profiles": better("delay_profile_corr", "baseline_delay_profile_corr", 0.0),
    }


def _less(value: float | None, target: float | None) -> bool | None:
    return None if value is None or target is None else value < target
