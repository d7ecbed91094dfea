# SPDX-License-Identifier: Apache-2.0
"""Stages take what they took here before, else what is usual times what this machine took of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rfgs_core.past import Speed, Stage, forecast, in_words, note_speed, past_speed, timed

USUAL = Speed(2.0, 1.0)


@pytest.fixture(autouse=True)
def no_past(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def stage(name: str = "walk", steps: int = 10, **what: int) -> Stage:
    return Stage(name, f"test-{name}", what, steps, USUAL)


def test_a_stage_that_ran_is_told_from_itself_and_others_are_scaled_by_it() -> None:
    assert forecast([stage()]).total_s == pytest.approx(12.0)
    note_speed(stage(size=1), Speed(0.0, 4.0))
    assert forecast([stage(size=1, steps=3)]).total_s == pytest.approx(12.0)
    assert forecast([stage(size=1)]).source == "as measured here before"
    other = forecast([stage(size=2), stage("run")])
    assert other.seconds == {"walk": pytest.approx(48.0), "run": pytest.approx(48.0)}
    assert other.source.startswith("estimated from usual speeds of two cores scaled to this")
    both = forecast([stage(size=1), stage("run")])
    assert both.source.startswith("run estimated from usual speeds")


def test_work_of_the_same_kind_tells_more_than_other_work() -> None:
    note_speed(stage("run"), Speed(0.0, 8.0))
    note_speed(stage(size=1), Speed(0.0, 2.0))
    assert forecast([stage(size=2)]).total_s == pytest.approx(24.0)


def test_a_stage_that_is_stopped_leaves_what_it_knows() -> None:
    with pytest.raises(KeyboardInterrupt), timed(stage()) as clock:
        for _ in range(3):
            clock.step()
        raise KeyboardInterrupt
    assert past_speed(stage()) is not None
    with timed(stage(size=3)) as clock:
        clock.step()
    assert past_speed(stage(size=3)) is None, "one step tells the start alone"


def test_stages_of_one_name_are_measured_if_all_of_them_were() -> None:
    note_speed(stage(size=1), Speed(0.0, 4.0))
    both = forecast([stage(size=1, steps=2), stage(size=2, steps=2)])
    assert both.seconds == {"walk": pytest.approx(8.0 + 16.0)} and not both.measured


def test_nothing_left_takes_no_time() -> None:
    assert forecast([stage(steps=0)]).total_s == 0.0


def test_a_cache_that_cannot_be_written_stops_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    note_speed(stage(), Speed(0.0, 4.0))
    assert forecast([stage()]).total_s == pytest.approx(12.0)


@pytest.mark.parametrize(("seconds", "words"), [(42.4, "42 s"), (600, "10 min"), (9000, "2.5 h")])
def test_times_are_told_in_words(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
