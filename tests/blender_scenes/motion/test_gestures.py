# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from blender_scenes.motion.gestures import STROKES, Gesture, minimum_jerk
from blender_scenes.motion.score import Figure, Posture, Score, compose
from blender_scenes.motion.seat import Sit

HERE = Posture((1.0, 2.0), 0.7)


def wrists(score: Score, times: np.ndarray, side: str = "R") -> np.ndarray:
    skeleton = score.figure.skeleton
    index = skeleton.index[f"wrist.{side}"]
    return np.stack([skeleton.joints(score.pose(float(t)))[index] for t in times])


def test_minimum_jerk_solves_its_boundary_value_problem() -> None:
    # Flash and Hogan: the sixth derivative vanishes, and position, speed and acceleration hold
    # at both ends. Solved here as a linear system instead of taken from the paper.
    powers = np.arange(6)
    rows = [[t**p for p in powers] for t in (0.0, 1.0)]
    rows += [[p * t ** max(p - 1, 0) for p in powers] for t in (0.0, 1.0)]
    rows += [[p * (p - 1) * t ** max(p - 2, 0) for p in powers] for t in (0.0, 1.0)]
    factors = np.linalg.solve(np.array(rows, dtype=float), np.array([0.0, 1, 0, 0, 0, 0]))
    times = np.linspace(0, 1, 101)
    made = np.array([minimum_jerk(t) for t in times])
    assert made == pytest.approx(times[:, None] ** powers @ factors, abs=1e-9)
    assert minimum_jerk(-1.0) == 0.0 and minimum_jerk(2.0) == 1.0


@pytest.mark.parametrize("kind", STROKES)
def test_hand_goes_where_and_when_it_should(figure: Figure, kind: str) -> None:
    score = compose(figure, HERE, [Gesture(kind, stroke_s=0.8)])
    strokes = STROKES[kind]
    raise_s = 0.5 * (score.duration_s - 0.8 * len(strokes))
    joints = figure.skeleton.joints(HERE.pose(figure))
    index = figure.skeleton.index
    arm_m = sum(
        np.linalg.norm(figure.skeleton.head(a) - figure.skeleton.head(b))
        for a, b in (("upperarm01.R", "lowerarm01.R"), ("lowerarm01.R", "wrist.R"))
    )
    middle = 0.5 * (joints[index["upperarm01.L"]] + joints[index["upperarm01.R"]])
    axes = arm_m * np.stack([HERE.ahead, -HERE.left, [0.0, 0.0, 1.0]])
    for number, stroke in enumerate(strokes):
        shares = np.linspace(0.001, 0.999, 21)
        found = wrists(score, raise_s + 0.8 * (number + shares))
        shape = [stroke(10 * t**3 - 15 * t**4 + 6 * t**5) for t in shares]
        assert np.abs(found - (middle + np.array(shape) @ axes)).max() < 1e-3


def test_straight_strokes_have_the_bell_of_minimum_jerk(figure: Figure) -> None:
    score = compose(figure, HERE, [Gesture("slide", stroke_s=1.0)])
    raise_s = 0.5 * (score.duration_s - 2.0)
    times = raise_s + np.arange(0, 1.0, 0.005)
    track = wrists(score, times)
    speed = np.linalg.norm(np.gradient(track, 0.005, axis=0), axis=1)
    way_m = np.linalg.norm(track[-1] - track[0])
    assert speed.max() == pytest.approx(15 / 8 * way_m, rel=0.01)
    assert times[speed.argmax()] == pytest.approx(raise_s + 0.5, abs=0.02)


def test_hands_meet_in_a_clap_and_nowhere_else(figure: Figure) -> None:
    score = compose(figure, HERE, [Gesture("clap", repeats=3)])
    times = np.arange(0, score.duration_s, 0.02)
    gap = np.linalg.norm(wrists(score, times, "L") - wrists(score, times, "R"), axis=1)
    minima = (gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]) & (gap[1:-1] < 0.12)
    assert minima.sum() == 3
    assert gap.min() > 0.03


@pytest.mark.parametrize("kind", STROKES)
def test_gestures_begin_and_end_at_rest(figure: Figure, kind: str) -> None:
    score = compose(figure, HERE, [Sit(0.45), Gesture(kind)])
    times = np.arange(1.6, score.duration_s + 0.1, 0.02)
    track = wrists(score, times)
    assert np.linalg.norm(np.diff(track, axis=0), axis=1).max() / 0.02 < 4.5
    assert np.linalg.norm(np.diff(track, n=2, axis=0), axis=1).max() / 0.02 < 1.6
    assert track[-1] == pytest.approx(track[0], abs=0.005)


def test_unknown_gestures_are_refused(figure: Figure) -> None:
    with pytest.raises(ValueError, match="push_pull"):
        compose(figure, HERE, [Gesture("wave")])
