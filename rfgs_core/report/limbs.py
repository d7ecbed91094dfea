# SPDX-License-Identifier: Apache-2.0
"""What a report says of limbs: skeletons beside the true ones, and which joints are seen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.figures.poses import pose_chart
from rfgs_core.pose import PoseEstimate, estimate_poses, score_poses
from rfgs_core.pose.confidence import NEAR_M, SEEN_M
from rfgs_core.report.page import LimbSection, Shot
from rfgs_core.report.tables import METHOD_LABEL, Cell, Column, Row, Table, show
from rfgs_core.run import Run
from rfgs_core.run.limbs import read_limbs
from rfgs_core.skeleton import JOINTS

_COLUMNS = (
    Column("seen", "seen", "%", True, 0, f"share that is expected within {SEEN_M:g} m"),
    Column("sigma_m", "expected error", "m", False, 3, "mean over frames and bodies"),
    Column("error_m", "error", "m", False, 3, "distance to the true joint"),
    Column("standing_m", "error standing", "m", False, 3, "of a standing body at the same place"),
)
#: Joints that a report names together, left and right.
_PARTS = {
    "pelvis and hips": ("pelvis", "hip"),
    "spine, neck and head": ("spine", "thorax", "neck", "head"),
    "knees": ("knee",),
    "ankles": ("ankle",),
    "shoulders": ("shoulder",),
    "elbows": ("elbow",),
    "wrists": ("wrist",),
}


def limbs_of(run: EvaluatedRun) -> LimbSection | None:
    """Skeletons and joints of a run; None where it does not tell limbs."""
    if not isinstance(run, Run) or read_limbs(run.path) is None:
        return None
    estimate = estimate_poses(run)
    scores = score_poses(estimate, run.sequence)
    truth = [run.sequence.joints(frame) for frame in estimate.frames]
    caption = (
        "Tracks from above, then bodies from the side: true in grey, from radio in orange. Bones "
        f"are dotted where the joint at their end is expected to be off by more than {SEEN_M:g} m."
    )
    chart = Shot(pose_chart(estimate, truth), caption)
    return LimbSection(chart, _sentences(scores), _table(estimate, scores))


def _sentences(scores: Mapping[str, Any]) -> list[str]:
    """Joints as a whole, and whether those that count as seen are near."""
    fit, confidence = scores["fit"], scores["confidence"]
    if fit["mpjpe_m"] is None or confidence is None:
        return ["This scene does not tell its people's joints: no error is known."]
    sentences = [
        f"Joints are {show(fit['mpjpe_m'], 3)} m off on average, those of a standing body at the "
        f"same place {show(scores['standing']['mpjpe_m'], 3)} m."
    ]
    share = show(100.0 * confidence["seen"], 0)
    if confidence["seen_near"] is None:
        return [*sentences, f"No joint is expected within {SEEN_M:g} m."]
    return [
        *sentences,
        f"{share}\u00a0% of the joints count as seen, {show(100.0 * confidence['seen_near'], 0)}"
        f"\u00a0% of these are within {NEAR_M:g} m.",
    ]


def _table(estimate: PoseEstimate, scores: Mapping[str, Any]) -> Table:
    """Each part of the body."""
    assert estimate.sigma_m is not None
    sigma_m = estimate.sigma_m.reshape(-1, len(JOINTS)).mean(axis=0)
    rows = []
    for part, names in _PARTS.items():
        own = [j for j, name in enumerate(JOINTS) if name.split("_")[-1] in names]
        values = {
            "seen": 100.0 * float(np.mean([scores["joints_seen"][JOINTS[j]] for j in own])),
            "sigma_m": float(sigma_m[own].mean()),
            "error_m": _mean(scores["fit"]["joints_m"], own),
            "standing_m": _mean(scores["standing"]["joints_m"], own),
        }
        cells = [Cell(show(values[c.key], c.digits), why="no joint is known") for c in _COLUMNS]
        rows.append(Row(part, "method", cells))
    return Table(f"Joints by {METHOD_LABEL}", _COLUMNS, rows, [])


def _mean(joints_m: Mapping[str, float] | None, own: list[int]) -> float | None:
    return None if joints_m is None else float(np.mean([joints_m[JOINTS[j]] for j in own]))
