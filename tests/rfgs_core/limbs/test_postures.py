# SPDX-License-Identifier: Apache-2.0
"""Postures by evidence: the book, how guesses are bred, and the path through a sequence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.articulated import Pose, people
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence.body import Posed, by_bounces, direct, figure_of, images_of, posed
from rfgs_core.limbs.evidence.entries import pairs_of
from rfgs_core.limbs.evidence.kernel import Images, log_evidence
from rfgs_core.limbs.evidence.library import about_z, headings_of, over_origin, upright
from rfgs_core.limbs.postures import book as books
from rfgs_core.limbs.postures import search as searching
from rfgs_core.limbs.postures import tell as telling
from rfgs_core.limbs.postures.book import PoseBook, blend
from rfgs_core.limbs.postures.chain import around, likeliest_path
from rfgs_core.limbs.postures.search import FrameSearch, is_upright, spread_out
from rfgs_core.limbs.postures.tell import can_tell, tell
from rfgs_core.limbs.propose import Joints
from rfgs_core.worlds.motion import random_motion

PLACE, HEADING = np.array([0.3, -0.2, 0.0]), 2.0


def about_y(angle_rad: float) -> np.ndarray:
    """A turn around y."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


@pytest.fixture(scope="module")
def body():
    return people().body(np.zeros(0))


@pytest.fixture(scope="module")
def small_book(body) -> PoseBook:
    """A few of each family."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(books, "SHARES", {"walk": 8, "stand": 4, "sit": 20, "squat": 6})
        return PoseBook.of(body, 1)


@pytest.fixture(scope="module")
def seated(walker_body):
    """A moment of another body that sits, facing along x above the origin."""
    motion = random_motion(np.random.default_rng(9), walker_body, "sit")
    moments = [motion.at(t) for t in np.linspace(0.0, motion.duration_s, 20)]
    low = min(moments, key=lambda pose: walker_body.joints17(pose)[0, 2])
    pose = over_origin(walker_body, low)
    return pose.turned(about_z(-float(headings_of(walker_body.joints17(pose)[None])[0])))


def test_pages_face_along_x_above_the_origin_and_know_their_like(body, small_book) -> None:
    joints = np.array([body.joints17(pose) for pose in small_book.poses])
    np.testing.assert_allclose(joints[:, 0, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.sin(headings_of(joints)), 0.0, atol=1e-6)
    away = np.linalg.norm(joints[:, None] - joints[None], axis=3).mean(axis=2)
    for page, alike in enumerate(small_book.alike):
        others = np.delete(away[page], page)
        assert page not in alike
        np.testing.assert_allclose(away[page, alike], np.sort(others)[: len(alike)])


def test_a_blend_is_on_the_way(body, small_book) -> None:
    one, other = small_book.poses[0], small_book.poses[-1]
    first, half, last = (body.joints17(blend(one, other, share)) for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(first, body.joints17(one), atol=1e-9)
    np.testing.assert_allclose(last, body.joints17(other), atol=1e-9)
    back = body.joints17(blend(other, one, 0.5))
    np.testing.assert_allclose(half, back, atol=1e-9)
    whole = np.linalg.norm(last - first, axis=1).mean()
    for end in (first, last):
        assert 0.3 * whole < np.linalg.norm(half - end, axis=1).mean() < 0.7 * whole


def test_the_best_of_few_directions_do_not_crowd_out_the_others(body, small_book, heard) -> None:
    guesses = [
        searching.Guess(small_book.poses[0], 0, heading, PLACE, np.array([float(score)]))
        for score, heading in enumerate([0.1, 0.1, *np.full(40, 3.0)])
    ]
    best = spread_out(guesses, 12)
    assert [guess.score for guess in best] == [41.0, 40.0, 1.0, 0.0]


def test_who_sits_is_told(heard, walker_joints, seated, body, small_book, monkeypatch) -> None:
    """One frame of another body on a seat: joints are nearer than of somebody who stands."""
    few = ((24, 3, 0.26, 0.06), (12, 4, 0.12, 0.03))
    monkeypatch.setattr(searching, "DRAWN", 120)
    monkeypatch.setattr(FrameSearch.bred, "__defaults__", (few,))
    monkeypatch.setattr(telling, "LATER", few[1:])
    monkeypatch.setattr(PoseBook, "of", lambda *_: small_book)
    frame = heard(seated, HEADING, PLACE)
    done: list[int] = []
    assert can_tell(frame)
    told = tell([frame], PLACE[None, :2] + [0.06, -0.05], 3, lambda: done.append(1))
    assert told is not None and told.lead > 100.0
    assert len(done) == telling.looks(1)
    truth = walker_joints(seated) @ about_z(HEADING).T + PLACE
    standing = body.joints17(upright(body)) @ about_z(HEADING).T + PLACE
    error, still = (
        np.linalg.norm(some - truth, axis=-1).mean() for some in (told.joints.xyz[0, 0], standing)
    )
    assert error < 0.5 * still
    off = headings_of(told.joints.xyz[:, 0])[0] - HEADING
    assert abs((off + np.pi) % (2.0 * np.pi) - np.pi) < 0.6
    assert told.joints.sigma_m.shape == (1, 1, 17)


def test_chance_comes_from_the_seed_alone(heard, seated, body, small_book, monkeypatch) -> None:
    monkeypatch.setattr(searching, "DRAWN", 3)
    frame, figure = heard(seated, HEADING, PLACE), figure_of(body)

    def scores(seed: int) -> list[float]:
        rng = np.random.default_rng(seed)
        search = FrameSearch(frame, PLACE[:2], figure, small_book, rng)
        return [guess.score for guess in search.bred(search.drawn(), ((2, 2, 0.1, 0.02),))]

    first = scores(1)
    assert first == sorted(first, reverse=True) and len(first) == 7
    assert scores(1) == first and scores(2) != first


def test_walls_mirror_who_lies_as_they_lie(heard, seated, body, small_book) -> None:
    """Evidence of a guess, term by term: who is upright is mirrored as somebody standing there."""
    frame, figure = heard(seated, HEADING, PLACE), figure_of(body)
    search = FrameSearch(frame, PLACE[:2], figure, small_book, np.random.default_rng(0))
    middle = np.array([*PLACE[:2], CENTRE_HEIGHT_M])
    pairs = pairs_of(frame, middle)

    def evidence(here: Posed, mirrored: Posed) -> np.ndarray:
        found = []
        for pair in pairs:
            images = images_of(pair, frame.bounds_m, middle)
            echoes = direct(here, pair, np.zeros(3)) + searching.ALPHA**2 * sum(
                by_bounces(mirrored.facets, pair, Images(*(part[[k]] for part in images)))
                for k in range(len(images.end))
            )
            found.append(log_evidence(pair.change, echoes, searching.LEAST_NOISE))
        return np.array(found)

    back = about_y(-0.5 * np.pi)
    lies = upright(body).turned(back, np.array([0.0, 0.0, 0.9])).moved(np.array([0.0, 0.0, -0.75]))
    stands = posed(figure, upright(body).moved(PLACE), pairs)
    for pose, own in ((small_book.poses[20], False), (lies, True)):
        assert is_upright(pose) != own
        guess = search.guess(pose, 20, HEADING, PLACE)
        here = posed(figure, guess.in_world, pairs, by_skin=False)
        wanted, other = evidence(here, stands), evidence(here, here)
        if own:
            wanted, other = other, wanted
        np.testing.assert_allclose(guess.log, wanted, atol=0.05)
        assert np.abs(guess.log - other).max() > 1.0


def test_who_lies_is_sought_farther_from_where_they_were_found(
    heard, seated, body, small_book, monkeypatch
) -> None:
    """The loudest place of a body that lies may be anywhere along it."""
    monkeypatch.setattr(FrameSearch, "guess", lambda _, *guess: guess)
    frame, figure = heard(seated, HEADING, PLACE), figure_of(body)
    stands = upright(body)

    def spread_m(pose: Pose) -> float:
        book = PoseBook([pose], small_book.alike)
        search = FrameSearch(frame, PLACE[:2], figure, book, np.random.default_rng(0))
        return float(np.std([spot[:2] - PLACE[:2] for *_, spot in search.drawn()]))

    assert spread_m(stands) == pytest.approx(searching.AROUND_M, rel=0.1)
    lies = stands.turned(about_y(-0.5 * np.pi))
    assert spread_m(lies) == pytest.approx(searching.LYING_AROUND_M, rel=0.1)


def test_every_search_of_a_frame_begins_anew(heard, seated, small_book, monkeypatch) -> None:
    few, draw, begun = ((2, 2, 0.1, 0.02),), FrameSearch.drawn, []
    monkeypatch.setattr(searching, "DRAWN", 3)
    monkeypatch.setattr(FrameSearch.bred, "__defaults__", (few,))
    monkeypatch.setattr(telling, "LATER", few)
    monkeypatch.setattr(PoseBook, "of", lambda *_: small_book)

    def drawn(search: FrameSearch) -> list[searching.Guess]:
        begun.append(draw(search))
        return list(begun[-1])

    monkeypatch.setattr(FrameSearch, "drawn", drawn)
    tell([heard(seated, HEADING, PLACE)], PLACE[None, :2], 3)
    assert len(begun) == telling.RESTARTS
    assert len({guess.heading for guesses in begun for guess in guesses}) == 3 * telling.RESTARTS


def test_who_stands_is_left_to_the_prior(heard, walker_body, small_book, monkeypatch) -> None:
    """Nobody is posed where standing is as likely."""
    monkeypatch.setattr(searching, "DRAWN", 40)
    few = ((8, 3, 0.2, 0.04),)
    monkeypatch.setattr(FrameSearch.bred, "__defaults__", (few,))
    monkeypatch.setattr(telling, "LATER", few)
    monkeypatch.setattr(PoseBook, "of", lambda *_: small_book)
    seen = [heard(upright(walker_body), HEADING, PLACE)]
    assert tell(seen, PLACE[None, :2]) is None


@pytest.mark.slow
def test_of_who_hardly_stands_out_only_the_heading_is_told(
    heard, walker_body, body, small_book, monkeypatch
) -> None:
    few = ((8, 3, 0.2, 0.04),)
    monkeypatch.setattr(searching, "DRAWN", 40)
    monkeypatch.setattr(FrameSearch.bred, "__defaults__", (few,))
    monkeypatch.setattr(telling, "LATER", few)
    monkeypatch.setattr(PoseBook, "of", lambda *_: small_book)
    one = heard(upright(walker_body), HEADING, PLACE)
    seen, own = [one, replace(one, time_s=one.time_s + 1.0)], body.joints17(upright(body))

    def said(lead: float, step_m: float) -> Joints | None:
        monkeypatch.setattr(telling, "_lead", lambda *_: lead)
        places = PLACE[:2] + np.array([[0.0, 0.5], [0.0, -0.5]]) * step_m
        told = tell(seen, places, 3)
        return None if told is None else told.joints

    posed, stands, goes = said(50.0, 0.0), said(30.0, 0.0), said(30.0, 0.35)
    assert said(10.0, 0.0) is None
    assert posed is not None and stands is not None and goes is not None
    for one in (stands, goes):
        np.testing.assert_allclose(one.xyz[:, 0, :, 2], np.tile(own[:, 2], (2, 1)), atol=1e-9)
    assert np.abs(posed.xyz[:, 0, :, 2] - own[:, 2]).max() > 0.01
    # Who stays faces as the poses do, and who goes, where they go.
    off = headings_of(stands.xyz[:, 0]) - headings_of(posed.xyz[:, 0])
    np.testing.assert_allclose(np.cos(off), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.cos(headings_of(goes.xyz[:, 0]) + 0.5 * np.pi), 1.0, atol=1e-6)


def test_who_is_low_does_not_stand(heard, seated, small_book, monkeypatch) -> None:
    few = ((24, 3, 0.26, 0.06), (12, 4, 0.12, 0.03))
    monkeypatch.setattr(searching, "DRAWN", 120)
    monkeypatch.setattr(FrameSearch.bred, "__defaults__", (few,))
    monkeypatch.setattr(telling, "LATER", few[1:])
    monkeypatch.setattr(PoseBook, "of", lambda *_: small_book)
    monkeypatch.setattr(telling, "_lead", lambda *_: 30.0)
    assert tell([heard(seated, HEADING, PLACE)], PLACE[None, :2], 3) is None


def test_one_radar_is_too_few(heard, seated) -> None:
    frame = heard(seated, HEADING, PLACE)
    links = frame.links & (frame.layout.tx_device[:, None] == frame.layout.rx_device)
    assert not can_tell(replace(frame, links=links))


@pytest.mark.parametrize(("bandwidth_hz", "enough"), [(20e6, False), (40e6, True)])
def test_a_band_that_resolves_no_walls_is_too_narrow(
    heard, seated, bandwidth_hz: float, enough: bool
) -> None:
    frame = heard(seated, HEADING, PLACE)
    count = len(frame.freq_hz)
    narrow = replace(frame, freq_hz=5.8e9 + np.arange(count) * bandwidth_hz / count)
    assert can_tell(narrow) is enough


def test_nobody_jumps_between_two_frames(body) -> None:
    """A guess that is a little likelier, but somewhere else, is passed by."""
    here = body.joints17(upright(body))
    there = here + np.array([1.5, 0.0, 0.0])
    joints = [np.array([here, there])] * 3
    score = [np.array([30.0, 0.0]), np.array([0.0, 20.0]), np.array([30.0, 0.0])]
    assert likeliest_path(score, joints, np.arange(3) * 0.2).tolist() == [0, 0, 0]
    score = [np.array([0.0, -2e4]), np.array([0.0, 2e4]), np.array([0.0, -2e4])]
    assert likeliest_path(score, joints, np.arange(3) * 0.2).tolist() == [0, 1, 0]


def test_who_goes_somewhere_looks_there(body) -> None:
    ahead = body.joints17(upright(body))
    behind = ahead @ about_z(np.pi).T
    joints = [np.array([ahead, behind]) + np.array([0.3 * frame, 0, 0]) for frame in range(4)]
    score = [np.array([0.0, 15.0])] * 4
    time_s = np.arange(4) * 0.3
    assert likeliest_path(score, joints, time_s).tolist() == [0, 0, 0, 0]
    still = [np.array([ahead, behind])] * 4
    assert likeliest_path(score, still, time_s).tolist() == [1, 1, 1, 1]


def test_the_mean_is_of_the_same_pose(body) -> None:
    pose, aside = body.joints17(upright(body)), np.array([0.1, 0.0, 0.0])
    joints = np.array([pose, pose + aside, pose + 10.0 * aside])
    mean, spread = around(np.array([7.0, 7.0, 100.0]), joints, 0)
    np.testing.assert_allclose(mean, pose + 0.5 * aside, atol=1e-9)
    np.testing.assert_allclose(spread, 0.05, atol=1e-9)
