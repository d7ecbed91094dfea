# SPDX-License-Identifier: Apache-2.0
"""Tracks from above and skeletons from the side, estimated beside true."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rfgs_core.figures.style import METHOD, TRUTH, new_figure
from rfgs_core.files import replacing
from rfgs_core.pose.estimate import PoseEstimate
from rfgs_core.skeleton import PARENTS

#: Frames shown as skeletons.
SHOWN = 4
#: Width of a skeleton's axes at least [m].
_NARROWEST_M = 0.9


def write_pose_chart(
    path: Path, estimate: PoseEstimate, truth: Sequence[Float[np.ndarray, "person 17 3"]]
) -> None:
    """Writes a PNG: the tracks, then people of a few frames seen along the x axis."""
    picked = np.unique(np.linspace(0, len(estimate.frames) - 1, SHOWN).astype(int))
    with new_figure(3.2 + 2.2 * len(picked), 3.4) as figure, replacing(path) as temporary:
        grid = figure.add_gridspec(1, len(picked) + 1, width_ratios=[1.5] + [1.0] * len(picked))
        _tracks(figure.add_subplot(grid[0, 0]), estimate, truth)
        for column, k in enumerate(picked):
            axes = figure.add_subplot(grid[0, column + 1])
            for person in truth[k]:
                _skeleton(axes, person, TRUTH)
            for body in estimate.joints[k]:
                _skeleton(axes, body, METHOD)
            axes.set_aspect("equal")
            # Who lies is no taller than the ticks of an axis.
            axes.set_ylim(top=max(axes.get_ylim()[1], 1.0))
            # Who stands is narrower than two labels of ticks.
            low_m, high_m = axes.get_xlim()
            short_m = 0.5 * max(_NARROWEST_M - (high_m - low_m), 0.0)
            axes.set_xlim(low_m - short_m, high_m + short_m)
            axes.set_title(f"frame {estimate.frames[k]}")
            axes.set_xlabel("y [m]")
            if column == 0:
                axes.set_ylabel("z [m]")
        figure.savefig(temporary, dpi=140, facecolor="white")


def _tracks(axes: Any, estimate: PoseEstimate, truth: Sequence[np.ndarray]) -> None:
    """Pelvis of everybody from above."""
    for person in range(truth[0].shape[0]):
        xy = np.array([row[person, 0, :2] for row in truth])
        axes.plot(*xy.T, "o-", color=TRUTH, label="true" if person == 0 else None)
    for body in range(estimate.joints.shape[1]):
        xy = estimate.joints[:, body, 0, :2]
        axes.plot(*xy.T, "s--", color=METHOD, label="estimated" if body == 0 else None)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title("tracks from above")
    axes.legend(loc="upper left", fontsize=7)


def _skeleton(axes: Any, joints: Float[np.ndarray, "17 3"], colour: str) -> None:
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            axes.plot(*joints[[parent, joint]][:, 1:].T, color=colour, linewidth=2)
