# SPDX-License-Identifier: Apache-2.0
"""The grid search that settings of neural fields were taken from.

Settings are chosen by the true surface, which favours the fields: those of RF-GS are not tuned to
the data that they are compared on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from itertools import product
from typing import Any

import numpy as np

from rfgs_core.dataset import Dataset
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.evaluate.geometry import geometry_metrics, reference_points, voxel_budget
from rfgs_core.evaluate.grid import Grid
from rfgs_core.fit.sampling import sample_points
from rfgs_core.measure.observations import observe
from rfgs_core.neural.fit import fit_field
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: What is tried of each objective; `finest_m` of `ngp` only, `octaves` of the others.
TRIED: dict[str, dict[str, tuple[float, ...]]] = {
    "features": {"learning_rate": (5e-3,), "contrast": (1.0, 2.0)},
    "propagation": {"learning_rate": (2e-3, 5e-3), "evenness": (0.0,)},
}
DETAIL: dict[str, dict[str, tuple[float, ...]]] = {
    "nerf": {"octaves": (4, 6)},
    "mip": {"octaves": (4, 6)},
    "ngp": {"finest_m": (0.06, 0.2)},
}


def candidates(steps: int, kinds: Sequence[str] = tuple(DETAIL)) -> list[FieldSettings]:
    """All settings that are tried, without the prior."""
    found = []
    for kind, (objective, tried) in product(kinds, TRIED.items()):
        choices = {**tried, **DETAIL[kind]}
        for values in product(*choices.values()):
            changes: dict[str, Any] = dict(zip(choices, values, strict=True))
            found.append(FieldSettings(kind=kind, objective=objective, steps=steps, **changes))  # type: ignore[arg-type]
    return found


def search(
    dataset: Dataset,
    radio: str,
    frame: int,
    config: TrainConfig,
    tried: Sequence[FieldSettings],
    on_fit: Callable[[], Any] = lambda: None,
) -> list[dict[str, Any]]:
    """F-scores of every setting on one frame, in the order they come in.

    Args:
        dataset: The data, of one sequence.
        radio: Which radio.
        frame: Which frame.
        config: Sample points of the objective `features`.
        tried: Settings.
        on_fit: Called after each fit.
    """
    sequence = dataset.sequence()
    observations = observe(sequence, radio, frame)
    reference = reference_points(*sequence.moving_mesh(frame)[:2])
    grid, voxels = Grid.over(sequence.bounds_m), voxel_budget(sequence.instances)
    rng = np.random.default_rng(sub_seed(0, "field search"))
    rows = []
    with one_torch_thread():
        points = sample_points(
            observations, config.grid_side, rng, MATCHED_FILTER, config.refine_levels
        )
        for settings in tried:
            fitted = fit_field(observations, settings, config, points)
            score = fitted.score(grid.centres(), grid.voxel_m).reshape(grid.shape)
            found = geometry_metrics(score.astype(np.float32), grid, reference, voxels)
            scores = {key: found[key] for key in ("f05", "f10", "f20")}
            rows.append({"radio": radio, "frame": frame, **asdict(settings), **scores})
            on_fit()
    return rows


def best(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The row of the highest mean F over the three distances, of each kind and objective."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["kind"], row["objective"]), []).append(row)
    return [max(group, key=_mean_f) for group in groups.values()]


def _mean_f(row: dict[str, Any]) -> float:
    return float(np.mean([row[key] for key in ("f05", "f10", "f20")]))


def search_table(rows: Sequence[dict[str, Any]]) -> str:
    """All rows as Markdown, the best ones of each kind and objective in bold."""
    head = ("field", "objective", "rate", "detail", "contrast / evenness", "F5", "F10", "F20")
    chosen = best(rows)
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row in rows:
        detail = f"{row['finest_m']} m" if row["kind"] == "ngp" else f"{row['octaves']} octaves"
        other = row["contrast"] if row["objective"] == "features" else row["evenness"]
        f10 = f"{row['f10']:.3f}"
        cells = (
            row["kind"],
            row["objective"],
            str(row["learning_rate"]),
            detail,
            str(other),
            f"{row['f05']:.3f}",
            f"**{f10}**" if row in chosen else f10,
            f"{row['f20']:.3f}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)
