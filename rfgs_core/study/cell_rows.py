# SPDX-License-Identifier: Apache-2.0
"""Cells as rows and as Markdown: means and deviations over seeds beside what the paper claims."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.evaluate.verdicts import leak
from rfgs_core.study.ablation import VARIANTS
from rfgs_core.study.paper_tables import ABLATED, CHANNEL_FIELDS, FIELDS, TRAINED
from rfgs_core.study.table import number

#: Columns: group and key of the metrics, header, format.
COLUMNS = (
    ("geometry", "f05", "F5", ".3f"),
    ("geometry", "f10", "F10", ".3f"),
    ("geometry", "f20", "F20", ".3f"),
    ("geometry", "centroid_m", "centroid [m]", ".2f"),
    ("rf", "element_snr_db", "elements [dB]", ".1f"),
    ("rf", "subcarrier_snr_db", "subcarriers [dB]", ".1f"),
)
#: Of what is trained alone: key, header, format.
TRAINED_COLUMNS = (
    ("gaussians", "Gaussians", ".0f"),
    ("render_fps", "drawn per second", ".0f"),
    ("train_s", "training [s]", ".0f"),
)
#: Picture PSNR that the paper claims [dB].
CLAIMED_DB = {
    **{(row.method, "wifi"): row.claimed_db for row in VARIANTS},
    ("rfgs", "wifi"): 33.7,
    ("paper", "wifi"): 33.7,
    ("paper", "mmwave"): 31.4,
    ("nerf", "wifi"): 21.4,
    ("mip", "wifi"): 23.1,
    ("ngp", "wifi"): 24.8,
    ("nerf", "mmwave"): 19.2,
    ("ngp", "mmwave"): 22.5,
    ("rfgs", "mmwave"): 31.4,
}
_LABELS = {
    "rfgs": "RF-GS", "rfgs_no_limbs": "RF-GS without limbs",
    GAUSSIANS_ALONE: "RF-GS, its Gaussians alone", "paper": "paper's recipe",
    "paper_prior": "paper's recipe, from our start",
    **{row.method: f"paper's recipe, from our start, {row.label}" for row in VARIANTS[1:]},
    "clean": "CLEAN", "omp": "OMP", "fista": "FISTA", "nnls": "NNLS of powers", "music": "MUSIC",
    "nerf": "RF-NeRF", "mip": "RF-MipNeRF", "ngp": "RF-InstantNGP", "ngrf": "direct sum, as nGRF",
    "wrfgs": "splatted signals, as WRF-GS",
}  # fmt: skip


@dataclass(frozen=True)
class MethodRow:
    """One method on one scene and radio."""

    scene: str
    radio: str
    method: str
    seeds: int
    mean: dict[str, float | None]
    """Means over seeds by key of a column."""
    deviation: dict[str, float | None]
    """Sample deviation over seeds; None of fewer than two."""
    claimed_psnr_db: float | None
    """What the paper claims of its pictures, another quantity; nobody has reproduced it."""


def method_rows(results: Iterable[Mapping[str, Any]]) -> list[MethodRow]:
    """Rows of finished cells, in the order they come in."""
    groups: dict[tuple[str, str, str], list[dict[str, float | None]]] = {}
    for result in results:
        for method, values in result["methods"].items():
            row = {key: values[group].get(key) for group, key, *_ in COLUMNS}
            own = method == result["method"]
            row |= {key: result.get(key) if own else None for key, *_ in TRAINED_COLUMNS}
            groups.setdefault((result["scene"], result["radio"], method), []).append(row)
    return [_row(*names, rows) for names, rows in groups.items()]


def _row(scene: str, radio: str, method: str, rows: list[dict[str, float | None]]) -> MethodRow:
    mean: dict[str, float | None] = {}
    deviation: dict[str, float | None] = {}
    for key in rows[0]:
        known = [value for row in rows if (value := row[key]) is not None]
        mean[key] = float(np.mean(known)) if known else None
        deviation[key] = float(np.std(known, ddof=1)) if len(known) > 1 else None
    claimed = CLAIMED_DB.get((method.split("_")[0] if method in FIELDS else method, radio))
    return MethodRow(scene, radio, method, len(rows), mean, deviation, claimed)


def label(method: str) -> str:
    """A method in words."""
    name, _, alone = method.partition(", ")
    words = _LABELS.get(name, name.replace("_", " "))
    if name in FIELDS:
        kind, objective, *prior = name.split("_")
        words = f"{_LABELS[kind]}, {objective}{', body prior' if prior else ''}"
    return f"{words}, without residual" if alone else words


def method_table(rows: Sequence[MethodRow]) -> str:
    """One table per scene and radio, below it who is strongest beside ours."""
    titles = [title for _, _, title, _ in COLUMNS]
    titles += [title for _, title, _ in TRAINED_COLUMNS]
    head = ("method", *titles, "claimed PSNR [dB], not reproduced")
    lines: list[str] = []
    for scene, radio in dict.fromkeys((row.scene, row.radio) for row in rows):
        lines += [f"{scene}, `{radio}`:", "", f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
        here = [row for row in rows if (row.scene, row.radio) == (scene, radio)]
        lines += [f"| {' | '.join(_cells(row))} |" for row in sorted(here, key=_order)]
        lines += ["", *strongest(here), *leaks(here)]
    return "\n".join([*lines, _NOTES, ""])


def is_baseline(method: str) -> bool:
    """Whether a method is none of ours, nor a part of one."""
    return method.partition(", ")[0] not in (*TRAINED, GAUSSIANS_ALONE)


def strongest(rows: Sequence[MethodRow]) -> list[str]:
    """RF-GS beside the best of whatever is not ours, per column; nothing where either is missing.

    Args:
        rows: Rows of one scene and radio.
    """
    ours = next((row for row in rows if row.method == "rfgs"), None)
    if ours is None:
        return []
    others = [row for row in rows if is_baseline(row.method)]
    parts = []
    for _, key, title, form in COLUMNS:
        sign = -1.0 if key == "centroid_m" else 1.0
        ranked = [(sign * v, row) for row in others if (v := row.mean[key]) is not None]
        own = ours.mean[key]
        if own is None or not ranked:
            continue
        value, best = max(ranked, key=lambda pair: pair[0])
        parts.append(f"{title} {label(best.method)} {sign * value:{form}} (RF-GS {own:{form}})")
    return [f"Strongest beside RF-GS: {'; '.join(parts)}.", ""] if parts else []


def leaks(rows: Sequence[MethodRow]) -> list[str]:
    """Warnings where the nearest visible entry tells hidden ones; none as it should be.

    Args:
        rows: Rows of one scene and radio.
    """
    nearest = [row.mean for row in rows if row.method == "nearest_element"]
    columns = (("element_snr_db", "elements"), ("subcarrier_snr_db", "subcarriers"))
    told = [leak(mean[key], what) for mean in nearest for key, what in columns]
    return [line for sentence in told if sentence for line in (sentence, "")]


def _order(row: MethodRow) -> int:
    """Ours, neural fields, then what needs no training."""
    name = row.method.partition(", ")[0]
    known = (*TRAINED, *ABLATED, *FIELDS, *CHANNEL_FIELDS)
    return known.index(name) if name in known else len(known)


def _cells(row: MethodRow) -> list[str]:
    shown = [_with(row, key, form) for _, key, _, form in COLUMNS]
    return [
        label(row.method),
        *shown,
        *(_with(row, key, form) for key, _, form in TRAINED_COLUMNS),
        number(row.claimed_psnr_db, ".1f"),
    ]


def _with(row: MethodRow, key: str, form: str) -> str:
    """Mean and deviation."""
    mean, deviation = row.mean[key], row.deviation[key]
    if mean is None or deviation is None:
        return number(mean, form)
    return f"{mean:{form}} ± {deviation:{form}}"


_NOTES = """\
Mean and sample deviation over seeds of trainings. Elements and subcarriers: signal over error of
csi − csi_static on entries that no method has seen; methods with Gaussians or fields carry on what
is left of the visible channel as well, and stand in a second row without that. Drawn per second:
the moving Gaussians of the first frame at 256 × 256 pixels, on this machine. The claimed PSNR is
that of pictures, a quantity that none of these columns is."""
