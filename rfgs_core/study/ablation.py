# SPDX-License-Identifier: Apache-2.0
"""The paper's ablation (its table 2), each variant trained and evaluated alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rfgs_core.settings import Density, Part
from rfgs_core.study.table import number


@dataclass(frozen=True)
class Variant:
    """One row of the ablation."""

    name: str
    """Name of its folder."""
    label: str
    """The paper's words."""
    claimed_db: float
    """Picture PSNR that the paper claims; nobody has reproduced it."""
    without: tuple[Part, ...] = ()
    """Parts that are left out."""
    density: Density | None = None
    """How Gaussians come and go; None: as the paper says."""

    @property
    def method(self) -> str:
        """Its name in the paper's tables."""
        return "paper" if self.name == "full" else f"paper_{self.name}"

    @property
    def options(self) -> tuple[str, ...]:
        """What `rfgs train` is told."""
        density = ("--density", self.density) if self.density else ()
        return (*(("--without", *self.without) if self.without else ()), *density)


VARIANTS = (
    Variant("full", "full", 33.7),
    Variant("no_weights", "w/o RF-weighted loss", 28.3, without=("rf_weights",)),
    Variant("no_densify", "w/o adaptive densify", 30.1, without=("densify",)),
    Variant("no_gradients", "w/o feature gradients", 29.8, without=("feature_gradients",)),
    Variant("no_pruning", "w/o pruning", 31.2, without=("prune",)),
    Variant("fixed", "fixed density", 26.9, density="none"),
    Variant("standard", "standard 3DGS densify", 24.1, density="3dgs"),
)


@dataclass(frozen=True)
class AblationRow:
    """What one variant gave."""

    variant: Variant
    f05: float | None
    f10: float | None
    gaussians: int
    """Moving Gaussians of the first frame at the end."""
    train_s: float


def ablation_row(variant: Variant, metrics: Mapping[str, Any], gaussians: int) -> AblationRow:
    """The row of a variant.

    Args:
        variant: Which one.
        metrics: Its `metrics.json`.
        gaussians: Moving Gaussians of its first frame.
    """
    geometry = metrics["geometry"]
    return AblationRow(
        variant, geometry["f05"], geometry["f10"], gaussians, float(metrics["train_s"])
    )


def ablation_table(rows: Sequence[AblationRow]) -> str:
    """The rows as Markdown, with what each part is worth."""
    head = ("variant", "F5", "F10", "against full", "Gaussians", "time", "claimed PSNR [dB]")
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    full = next((row.f10 for row in rows if row.variant.name == "full"), None)
    for row in rows:
        change = None if full is None or row.f10 is None else row.f10 - full
        cells = (
            row.variant.label,
            number(row.f05),
            number(row.f10),
            number(change, "+.3f") if row.variant.name != "full" else "–",
            str(row.gaussians),
            f"{row.train_s:.0f} s",
            f"{row.variant.claimed_db:.1f}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, "", _NOTES, ""])


_NOTES = """\
F5, F10: F-score at 5 and 10 cm, mean over frames, of the paper's recipe and losses. Last column:
the paper's picture quality of the same variant: claimed, not reproduced, and another quantity."""
