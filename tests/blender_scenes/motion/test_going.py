# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from blender_scenes.motion.gait import Manner
from blender_scenes.motion.going import Stay, Turn, Walk
from blender_scenes.motion.path import RoundedPath
from blender_scenes.motion.score import Figure, Piece, Posture, Score, breath_at, compose

HERE = Posture((0.5, -0.2), 0.3)
STEP_S = 0.02


Follow = Callable[[Score, float], np.ndarray]


@pytest.fixture(scope="module")
def outing(figure: Figure, joints_over: Follow) -> tuple[Score, np.ndarray]:
    pieces = [Walk([(2.5, -0.2), (2.5, 1.8)], 1.2), Turn(100), Stay(1.5), Walk([(0.5, 1.8)], 0.8)]
    score = compose(figure, HERE, pieces)
    return score, joints_over(score, STEP_S)


def test_corners_are_arcs_of_their_radius() -> None:
    path = RoundedPath([(0, 0), (2, 0), (2, 2), (3, 3)], radius_m=0.5)
    s = np.linspace(0, path.length_m, 4001)
    points = path.position(s)
    steps = np.diff(points, axis=0)
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(path.length_m, rel=1e-5)
    assert points[-1] == pytest.approx([3, 3])
    measured = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    assert np.abs(measured - path.heading(0.5 * (s[1:] + s[:-1]))).max() < 2e-3
    curvature = np.gradient(path.heading(s), s)
    assert np.abs(curvature).max() == pytest.approx(1 / 0.5, rel=0.01)
    # It goes on straight beyond both ends.
    assert path.position(-1.0) == pytest.approx([-1, 0])
    assert path.position(path.length_m + 2**0.5) == pytest.approx([4, 4])


def test_paths_that_cannot_be_walked_are_refused() -> None:
    with pytest.raises(ValueError, match="turns back"):
        RoundedPath([(0, 0), (1, 0), (0, 0)])
    with pytest.raises(ValueError, match="two or more"):
        RoundedPath([(0, 0), (0, 0)])


def test_nothing_jumps_between_pieces_or_within(outing: tuple[Score, np.ndarray]) -> None:
    _, joints = outing
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=2) / STEP_S
    assert speed.max() < 5.0
    change = np.linalg.norm(np.diff(joints, n=2, axis=0), axis=2) / STEP_S
    assert change.max() < 2.2


def test_feet_on_the_ground_do_not_slide(outing: tuple[Score, np.ndarray]) -> None:
    score, joints = outing
    skeleton = score.figure.skeleton
    for side in "LR":
        toe = joints[:, skeleton.index[f"toe1-1.{side}"]]
        ankle = joints[:, skeleton.index[f"foot.{side}"]]
        # A foot carries while the other one swings, and it is the lower one.
        carries = toe[:, 2] < skeleton.head(f"toe1-1.{side}")[2] + 1e-3
        moved = np.linalg.norm(toe - toe[0], axis=1)
        runs = np.split(np.arange(len(toe)), np.flatnonzero(np.diff(carries.astype(int))) + 1)
        held = [run for run in runs if carries[run[0]] and len(run) > 8]
        assert len(held) >= 4
        for run in held:
            spread = np.ptp(toe[run], axis=0)
            assert spread.max() < 0.01, (side, run[0] * STEP_S, spread)
        assert moved.max() > 1.0
        assert ankle[:, 2].min() > skeleton.head(f"foot.{side}")[2] - 0.01


def test_person_arrives_where_sent_and_looks_there(figure: Figure) -> None:
    score = compose(figure, HERE, [Walk([(2.5, -0.2), (2.5, 1.8)], 1.2)])
    assert score.end.place_m == pytest.approx((2.5, 1.8))
    assert score.end.heading_rad == pytest.approx(np.pi / 2)
    root = score.pose(score.duration_s).root
    assert root[:2] == pytest.approx([2.5, 1.8], abs=1e-3)
    turned = compose(figure, HERE, [Turn(-135)])
    assert turned.end.heading_rad == pytest.approx(0.3 - np.radians(135))
    assert turned.end.place_m == pytest.approx(HERE.place_m)


def test_full_stride_has_the_speed_asked_for(figure: Figure) -> None:
    walk = Walk([(6.5, -0.2)], 1.3, open_start=True, open_end=True)
    score = compose(figure, Posture((0.5, -0.2), 0.0), [walk])
    assert score.duration_s == pytest.approx(6.0 / 1.3)
    start, end = score.pose(0.0).root, score.pose(score.duration_s - 1e-6).root
    assert start[0] == pytest.approx(0.5, abs=1e-6) and end[0] == pytest.approx(6.5, abs=1e-5)


def test_legs_never_stretch(outing: tuple[Score, np.ndarray]) -> None:
    score, joints = outing
    skeleton = score.figure.skeleton
    for side in "LR":
        hip, knee, ankle = (
            joints[:, skeleton.index[f"{bone}.{side}"]]
            for bone in ("upperleg01", "lowerleg01", "foot")
        )
        rest = [skeleton.head(f"{bone}.{side}") for bone in ("upperleg01", "lowerleg01", "foot")]
        thigh, shin = np.linalg.norm(rest[1] - rest[0]), np.linalg.norm(rest[2] - rest[1])
        assert np.linalg.norm(knee - hip, axis=1) == pytest.approx(thigh)
        assert np.linalg.norm(ankle - knee, axis=1) == pytest.approx(shin)
        assert np.linalg.norm(ankle - hip, axis=1).max() < 0.998 * (thigh + shin)


def test_people_walk_differently(figure: Figure, joints_over: Follow) -> None:
    pieces: list[Piece] = [Walk([(3.5, -0.2)], 1.1)]
    other = Figure(figure.skeleton, Manner(arm_swing=1.4, sway=1.5, cadence=1.1, stoop_rad=0.1))
    swings = []
    for who in (figure, other):
        joints = joints_over(compose(who, Posture((0.5, -0.2), 0.0), pieces), STEP_S)
        wrist = joints[:, who.skeleton.index["wrist.L"]] - joints[:, who.skeleton.index["root"]]
        swings.append(np.ptp(wrist[:, 0]))
    assert swings[1] > 1.2 * swings[0]


def test_labels_say_what_is_done(outing: tuple[Score, np.ndarray]) -> None:
    score, _ = outing
    said = [score.label(t) for t in np.arange(0, score.duration_s + 0.5, 0.05)]
    order = [label for label, before in zip(said, ["", *said], strict=False) if label != before]
    assert order == ["turn", "walk", "turn", "stand", "turn", "walk", "stand"]


def test_breath_goes_in_and_out_at_its_rate() -> None:
    times = np.arange(0, 60, 0.01)
    values = np.array([breath_at(t, 15) for t in times])
    assert values.min() == pytest.approx(0, abs=1e-4) and values.max() == pytest.approx(1, abs=1e-4)
    assert ((values[1:-1] > values[:-2]) & (values[1:-1] > values[2:])).sum() == 15


def test_standing_is_never_frozen(figure: Figure, joints_over: Follow) -> None:
    joints = joints_over(compose(figure, HERE, [Stay(6.0)]), 0.1)
    head = joints[:, figure.skeleton.index["head"]]
    foot = joints[:, figure.skeleton.index["foot.L"]]
    assert 0.002 < np.ptp(head, axis=0)[:2].max() < 0.04
    assert np.ptp(foot, axis=0).max() < 1e-9


def test_a_walk_from_the_floor_is_refused(figure: Figure) -> None:
    with pytest.raises(ValueError, match="standing"):
        compose(figure, Posture((0, 0), 0.0, kind="lie"), [Walk([(1, 0)])])
