# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from blender_scenes.motion.score import Figure, Posture, compose
from blender_scenes.motion.stairs import Climb

HERE = Posture((0.0, 0.0), 0.0)


def tread_height(x: np.ndarray, climb: Climb) -> np.ndarray:
    """Height of the stairs [m] at `x` [m] ahead."""
    # Going down, the edge belongs to the upper tread: a foot may stand over it.
    passed = np.floor((x - climb.to_first_m) / climb.tread_m) + 1
    return climb.rise_m * np.clip(passed, 0, climb.count)


@pytest.mark.parametrize("rise_m", [0.15, 0.18, -0.17])
def test_feet_stand_on_treads_and_clear_the_edges(figure: Figure, rise_m: float) -> None:
    climb = Climb(4, rise_m)
    score = compose(figure, HERE, [climb])
    skeleton = figure.skeleton
    deepest = 0.0
    for time_s in np.arange(0, score.duration_s, 0.02):
        pose = score.pose(float(time_s))
        points = skeleton.touching(pose, "foot", "toe")
        deepest = min(deepest, (points[:, 2] - tread_height(points[:, 0], climb)).min())
    assert deepest > -0.005
    end = skeleton.joints(score.pose(score.duration_s))
    assert score.end.floor_m == pytest.approx(4 * rise_m)
    for side in "LR":
        above = end[skeleton.index[f"foot.{side}"], 2] - skeleton.head(f"foot.{side}")[2]
        assert above == pytest.approx(4 * rise_m, abs=1e-6)


def test_pelvis_rises_steadily(figure: Figure) -> None:
    score = compose(figure, HERE, [Climb(5, 0.17)])
    heights = np.array([score.pose(t).root[2] for t in np.arange(0, score.duration_s, 0.02)])
    assert np.diff(heights).min() > -0.006
    assert heights[-1] - heights[0] == pytest.approx(0.85, abs=1e-4)
    assert np.abs(np.diff(heights)).max() / 0.02 < 0.8
