# SPDX-License-Identifier: Apache-2.0
"""Stages before frames are fitted have bars of their own, and tell what a step of each took."""

from __future__ import annotations

import pytest

from rfgs_core.run import pose_bars
from rfgs_core.run.pose_bars import PoseBars


def test_each_stage_has_a_bar_and_a_speed_of_its_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 0.0
    monkeypatch.setattr(pose_bars.time, "perf_counter", lambda: now_s)
    with PoseBars() as bars:
        step = bars.begin("finding people", 2)
        for _ in range(2):
            now_s += 30.0
            step()
        step = bars.begin("posing people", 4)
        for _ in range(4):
            now_s += 0.5
            step()
    assert bars.step_s == {"finding people": 30.0, "posing people": 0.5}
    said = capsys.readouterr().err
    assert "finding people: 100%" in said and "posing people: 100%" in said
    assert said.index("posing people") > said.rindex("finding people")


def test_a_stage_left_before_its_end_tells_no_speed(capsys: pytest.CaptureFixture[str]) -> None:
    """That people do not walk is clear before all looks are taken."""
    with PoseBars() as bars:
        step = bars.begin("posing people", 4)
        step()
        bars.begin("seeking postures", 0)()
    assert bars.step_s == {}
    said = capsys.readouterr().err
    assert " 25%" in said and "seeking" not in said


def test_a_bar_is_closed_when_work_stops(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), PoseBars() as bars:
        bars.begin("finding people", 3)
        raise KeyboardInterrupt
    assert bars.step_s == {}
    assert capsys.readouterr().err.endswith("\n")
