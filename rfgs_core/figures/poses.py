# SPDX-License-Identifier: Apache-2.0
"""Tracks from above and skeletons from the side, estimated beside true."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Float64

from rfgs_core.figures.style import METHOD, TRUTH, figure_uri, new_figure, write_picture
from rfgs_core.pose.confidence import SEEN_M
from rfgs_core.pose.estimate import PoseEstimate
from rfgs_core.skeleton import JOINTS, PARENTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Frames shown as skeletons.
SHOWN = 4
#: Width of a skeleton's axes at least [m].
_NARROWEST_M = 0.9
_HIPS = [JOINTS.index(f"{side}_hip") for side in ("left", "right")]
#: Directions that differ by less from an axis are called by its name [rad].
_AXIS_RAD = np.deg2rad(2.0)

Truth = Sequence[Float[np.ndarray, "person 17 3"]]


def write_pose_chart(path: Path, estimate: PoseEstimate, truth: Truth) -> None:
    """Writes a PNG: the tracks, then people of a few frames from the side."""
    with _figure(estimate, truth) as figure:
        write_picture(figure, path)


def pose_chart(estimate: PoseEstimate, truth: Truth) -> str:
    """The same as a data URI."""
    with _figure(estimate, truth) as figure:
        return figure_uri(figure)


@contextmanager
def _figure(estimate: PoseEstimate, truth: Truth) -> Iterator[Figure]:
    """Bones whose farther joint does not count as seen are dotted."""
    picked = np.unique(np.linspace(0, len(estimate.frames) - 1, SHOWN).astype(int))
    angle = ahead(estimate.joints)
    seen = np.ones(estimate.joints.shape[:3], dtype=bool)
    if estimate.sigma_m is not None:
        seen = estimate.sigma_m <= SEEN_M
    with new_figure(3.2 + 2.2 * len(picked), 3.4) as figure:
        grid = figure.add_gridspec(1, len(picked) + 1, width_ratios=[1.5] + [1.0] * len(picked))
        _tracks(figure.add_subplot(grid[0, 0]), estimate, truth, bool(seen.all()))
        for column, k in enumerate(picked):
            axes = figure.add_subplot(grid[0, column + 1])
            for person in truth[k]:
                _skeleton(axes, person, TRUTH, angle, np.ones(len(JOINTS), dtype=bool))
            for body, sure in zip(estimate.joints[k], seen[k], strict=True):
                _skeleton(axes, body, METHOD, angle, sure)
            axes.set_aspect("equal")
            # Who lies is no taller than the ticks of an axis.
            axes.set_ylim(top=max(axes.get_ylim()[1], 1.0))
            # Who stands is narrower than two labels of ticks.
            low_m, high_m = axes.get_xlim()
            short_m = 0.5 * max(_NARROWEST_M - (high_m - low_m), 0.0)
            axes.set_xlim(low_m - short_m, high_m + short_m)
            axes.set_title(f"frame {estimate.frames[k]}")
            axes.set_xlabel(_name(angle))
            if column == 0:
                axes.set_ylabel("z [m]")
        yield figure


def ahead(joints: Float64[np.ndarray, "*frame 17 3"]) -> float:
    """Line on the ground along which bodies face, one way or the other, on the whole [rad].

    Across it one sees how legs swing, how somebody sits, and how long who lies is.

    Returns:
        In (−π/4, 3π/4], so that it points along +x or +y more than against them.
    """
    hips = (joints[..., _HIPS[1], :2] - joints[..., _HIPS[0], :2]).reshape(-1, 2)
    # Twice the angle is the same for both ways.
    twice = np.sum((hips[:, 0] + 1j * hips[:, 1]) ** 2)
    angle = 0.5 * float(np.angle(twice)) + 0.5 * np.pi
    return angle - np.pi if angle > 0.75 * np.pi else angle


def _name(angle: float) -> str:
    for name, at in (("x", 0.0), ("y", 0.5 * np.pi)):
        if abs(angle - at) < _AXIS_RAD:
            return f"{name} [m]"
    return f"{np.rad2deg(angle):.0f}° from x [m]"


def _tracks(axes: Any, estimate: PoseEstimate, truth: Truth, all_seen: bool) -> None:
    """Pelvis of everybody from above."""
    for person in range(truth[0].shape[0]):
        xy = np.array([row[person, 0, :2] for row in truth])
        axes.plot(*xy.T, "o-", color=TRUTH, label="true" if person == 0 else None)
    for body in range(estimate.joints.shape[1]):
        xy = estimate.joints[:, body, 0, :2]
        axes.plot(*xy.T, "s--", color=METHOD, label="estimated" if body == 0 else None)
    if not all_seen:
        label = f"expected error over {SEEN_M:g} m"
        axes.plot([], [], ":", color=METHOD, linewidth=2, label=label)
    # Of somebody at rest millimetres are no track.
    middle = estimate.joints[..., 0, :2].reshape(-1, 2).mean(axis=0)
    axes.update_datalim([middle - _NARROWEST_M / 2.0, middle + _NARROWEST_M / 2.0])
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title("tracks from above")
    axes.legend(loc="upper left", fontsize=7)


def _skeleton(
    axes: Any,
    joints: Float[np.ndarray, "17 3"],
    colour: str,
    angle: float,
    seen: Bool[np.ndarray, "17"],
) -> None:
    along = joints[:, 0] * np.cos(angle) + joints[:, 1] * np.sin(angle)
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            ends, style = [parent, joint], "-" if seen[joint] else ":"
            axes.plot(along[ends], joints[ends, 2], style, color=colour, linewidth=2)
