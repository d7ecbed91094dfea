# SPDX-License-Identifier: Apache-2.0
"""The likeliest walk through a sequence, by hand and from what a radio hears."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rfgs_core.articulated import people
from rfgs_core.limbs.evidence import tell as telling
from rfgs_core.limbs.evidence.follow import stood, walked
from rfgs_core.limbs.evidence.library import PHASES, about_z, headings_of, strides, upright
from rfgs_core.limbs.evidence.tell import Told, best_walk, tell
from rfgs_core.limbs.evidence.track import course_of, looks_of, way_of
from rfgs_core.limbs.propose import Joints
from rfgs_core.skeleton import JOINTS

SHIFTS = np.array([[0.0, 0.0, 0.0], [0.04, 0.0, 0.0], [-0.04, 0.0, 0.0]])
STRIDE_S = 1.2


def test_a_phase_is_followed_past_a_frame_that_misleads() -> None:
    time_s = np.arange(10) * 0.1
    phase = (0.15 + time_s / STRIDE_S / 0.9) % 1.0
    bins = np.arange(PHASES) / PHASES
    apart = np.abs((bins - phase[:, None] + 0.5) % 1.0 - 0.5)
    log = -0.5 * (apart / 0.06) ** 2
    log[4] = -log[4]
    log = log[..., None] + np.array([0.0, 3.0, -3.0])
    path = walked(log, SHIFTS, time_s, STRIDE_S)
    off = np.abs((path.phase - phase + 0.5) % 1.0 - 0.5)
    assert off.max() < 1.0 / PHASES
    assert set(path.shift.tolist()) == {1}


def test_who_stands_has_one_phase() -> None:
    log = np.tile([0.0, 0.0, 2.0], (4, 1))
    path = stood(log, SHIFTS, np.arange(4) * 0.1)
    assert path.phase.tolist() == [0.0] * 4 and path.shift.tolist() == [2] * 4
    # Two nat a frame, less what it costs to be 4 cm beside the way in each.
    assert path.score == pytest.approx(4 * (2.0 - 0.5 * (0.04 / 0.05) ** 2))


def test_a_way_is_smooth_and_knows_where_it_leads() -> None:
    time_s = np.arange(21) * 0.1
    truth = np.stack([0.8 * time_s, 0.3 * time_s], axis=1)
    noisy = truth + np.random.default_rng(0).normal(0.0, 0.05, truth.shape)
    way = way_of(noisy, time_s)
    assert np.linalg.norm(way.xy - truth, axis=1).mean() < 0.035
    np.testing.assert_allclose(way.heading, np.arctan2(0.3, 0.8), atol=0.15)
    np.testing.assert_allclose(way.speed_m_s, np.hypot(0.8, 0.3), atol=0.12)


def test_a_course_is_known_where_frames_are_seconds_apart() -> None:
    time_s = np.array([0.0, 2.0, 5.0])
    places = np.stack([-0.5 * time_s, 0.5 * time_s], axis=1)
    # Too far apart for a way to be smoothed along it.
    assert way_of(places, time_s).speed_m_s.max() == 0.0
    heading, speed_m_s = course_of(places, time_s)
    np.testing.assert_allclose(heading, 0.75 * np.pi)
    np.testing.assert_allclose(speed_m_s, np.sqrt(0.5))
    assert course_of(places[:1], time_s[:1])[1].tolist() == [0.0]


def test_who_stops_looks_as_they_went_and_who_starts_as_they_will() -> None:
    time_s = np.arange(12) * 0.8
    ahead = np.array([np.cos(2.0), np.sin(2.0)])
    for goes in (slice(None, 6), slice(6, None)):
        speed_m_s = np.zeros(12)
        speed_m_s[goes] = 0.7
        truth = np.cumsum(speed_m_s * 0.8)[:, None] * ahead
        places = truth + np.random.default_rng(1).normal(0.0, 0.05, truth.shape)
        way = way_of(places, time_s)
        off = np.abs(np.angle(np.exp(1j * (looks_of(way, time_s) - 2.0))))
        assert off.max() < 0.35
        # Of who stays the places found lead anywhere.
        assert np.abs(np.angle(np.exp(1j * (way.heading - 2.0)))).max() > 1.0
    still = way_of(np.random.default_rng(2).normal(0.0, 0.02, (12, 2)), time_s)
    np.testing.assert_array_equal(looks_of(still, time_s), still.heading)


def test_strides_start_with_the_left_foot_ahead_and_face_along_x() -> None:
    body = people().body(np.zeros(0))
    found = strides(body, 1.0, 2, seed=3)
    assert len(found) == 2
    for stride in found:
        joints = np.array([body.joints17(pose) for pose in stride.poses])
        ahead = joints[:, JOINTS.index("left_ankle"), 0] - joints[:, JOINTS.index("right_ankle"), 0]
        assert ahead[0] > 0.9 * ahead.max() and ahead[PHASES // 2] < 0.0
        np.testing.assert_allclose(headings_of(joints), 0.0, atol=0.25)
        np.testing.assert_allclose(joints[:, 0, :2], 0.0, atol=1e-9)
        assert 0.8 < stride.lasts_s < 2.0


def test_who_bends_the_legs_walks_lower_on_level_feet() -> None:
    body = people().body(np.zeros(0))
    stride = strides(body, 1.0, 1, seed=3)[0]
    legs = [JOINTS.index(f"left_{name}") for name in ("hip", "knee", "ankle")]
    before, after = (
        np.array([body.joints17(pose) for pose in one.poses])
        for one in (stride, stride.bent(body, 0.15))
    )
    assert 0.015 < (before[:, 0, 2] - after[:, 0, 2]).mean() < 0.05
    lengths = [np.linalg.norm(np.diff(some[:, legs], axis=1), axis=2) for some in (before, after)]
    np.testing.assert_allclose(*lengths, atol=1e-9)
    # On one leg the ankle stays where it was, and everything above the legs only comes down.
    single = [k for k in range(PHASES) if k % (PHASES // 2) in (1, 2, 3, 4)]
    lowest = [some[single][..., 2].min(axis=1) for some in (before, after)]
    np.testing.assert_allclose(*lowest, atol=2e-3)
    above = [j for j, name in enumerate(JOINTS) if not name.endswith(("knee", "ankle"))]
    fell = (before - after)[:, above]
    np.testing.assert_allclose(fell, np.broadcast_to(fell[:, :1], fell.shape), atol=1e-9)
    same = stride.bent(body, 0.0)
    for one, other in zip(stride.poses, same.poses, strict=True):
        np.testing.assert_allclose(one.turns, other.turns, atol=1e-12)


def test_a_walk_of_another_body_is_told(heard, stride, walker_joints, monkeypatch) -> None:
    """Four frames, a third of a second apart: joints nearer than of somebody who stands."""
    # Nothing comes by way of walls here, and one stride is enough, with legs bent in two ways.
    monkeypatch.setattr(telling, "ALPHAS", (0.0,))
    monkeypatch.setattr(telling, "STRIDES", 1)
    monkeypatch.setattr(telling, "BENDS_RAD", (0.0, 0.1))
    time_s = np.arange(4) * 0.3
    phase = np.round(time_s / stride.lasts_s * PHASES).astype(int) % PHASES
    places = np.column_stack([0.9 * time_s - 0.6, 0.1 * time_s, 0.0 * time_s])
    heading = float(np.arctan2(0.1, 0.9))
    seen = [
        replace(heard(stride.poses[p], heading, place), time_s=float(t))
        for p, place, t in zip(phase, places, time_s, strict=True)
    ]
    found = places[:, :2] + np.random.default_rng(5).normal(0.0, 0.03, (4, 2))
    told = tell(seen, found)
    assert told is not None and told.lead > 50.0
    turn = about_z(heading).T
    truth = np.array(
        [walker_joints(stride.poses[p]) @ turn + x for p, x in zip(phase, places, strict=True)]
    )
    body = people().body(np.zeros(0))
    standing = body.joints17(upright(body)) @ turn + places[:, None]
    error, still = (
        np.linalg.norm(some - truth, axis=2).mean() for some in (told.joints.xyz[:, 0], standing)
    )
    assert error < 0.8 * still
    assert told.joints.sigma_m.shape == (4, 1, 17) and told.joints.sigma_m.min() > 0.0
    # Who stays on the spot does not walk.
    assert best_walk(seen, np.zeros((4, 2))) is None


@pytest.mark.parametrize(
    ("lead", "agree", "draws"),
    [(700.0, 0.6, 2), (300.0, 0.6, 1), (700.0, 0.7, 1), (-5.0, 0.9, 1)],
)
def test_strides_are_drawn_again_where_a_walk_stands_out_and_frames_do_not_agree(
    monkeypatch, lead: float, agree: float, draws: int
) -> None:
    """Ten frames: 40 nat each is what stands out. The second draw is another, and the last."""
    asked: list[int] = []
    joints = Joints(np.zeros((10, 1, 17, 3)), np.ones((10, 1, 17)))

    def one(seen: Any, axes_xy: np.ndarray, seed: int = 0, *_: Any) -> Told:
        asked.append(seed)
        return Told(joints, lead, agree if len(asked) == 1 else 0.8)

    monkeypatch.setattr(telling, "best_walk", one)
    frames: Any = [SimpleNamespace()] * 10
    found = tell(frames, np.zeros((10, 2)), seed=3)
    assert len(asked) == len(set(asked)) == draws
    told = lead > 0.0 and (draws == 2 or agree >= 0.65)
    assert (found is not None) == told


def test_who_halts_on_the_way_or_is_seen_too_shortly_is_not_told(monkeypatch) -> None:
    monkeypatch.setattr(telling, "strides", lambda *_: pytest.fail("it went on"))
    time_s = np.arange(40) * 0.1
    seen: Any = [SimpleNamespace(time_s=float(t)) for t in time_s]
    halts = np.stack([np.minimum(time_s, 2.0), 0.0 * time_s], axis=1)
    assert best_walk(seen, halts) is None
    assert best_walk(seen[:6], 0.1 * np.arange(12).reshape(6, 2)) is None
    assert best_walk(seen[::20], halts[::20]) is None
