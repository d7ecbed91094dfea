# SPDX-License-Identifier: Apache-2.0
"""The time left of a training is right when stages cost what they cost, also the first time."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rfgs_core.past import forecast
from rfgs_core.run import costs
from rfgs_core.run.costs import (
    USUAL,
    CostBar,
    Costs,
    count_stage,
    expected,
    pose_stages,
    price_line,
    stages,
)
from rfgs_core.settings import TrainConfig, TrainOptions

STEPS = 10
#: What the stages of the pretended training take [s].
TRUE = Costs(find_s=40.0, solve_s=10.0, step_s=1.0)


class Clock:
    """A clock that stands still unless it is told."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Clock:
    made = Clock()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(costs.time, "perf_counter", made)
    return made


@pytest.fixture
def run(tmp_path: Path) -> Any:
    """As much of a run as costs are asked of."""
    layout = SimpleNamespace(measured=np.ones((4, 8), bool))
    return SimpleNamespace(
        frames=[1, 2, 3, 4],
        config=SimpleNamespace(radio="wifi", settings=TrainConfig()),
        sequence=SimpleNamespace(layout=lambda _radio: layout),
        ply_path=lambda frame: tmp_path / f"{frame}.ply",
    )


def fit_frame(bar: CostBar, clock: Clock) -> None:
    bar.begin("finding")
    clock.now_s += TRUE.find_s
    bar.found("solving")
    clock.now_s += TRUE.solve_s
    bar.solved()
    for _ in range(STEPS):
        clock.now_s += TRUE.step_s
        bar.step("refining")
    bar.finish_frame()


def test_after_one_frame_the_rest_is_what_that_took(clock: Clock, run: Any) -> None:
    bar = CostBar(run, STEPS)
    assert bar._bar.total == pytest.approx(4 * USUAL.frame_s(STEPS))
    fit_frame(bar, clock)
    assert bar._bar.total - bar._bar.n == pytest.approx(3 * TRUE.frame_s(STEPS))
    bar.skip()
    assert bar._bar.total - bar._bar.n == pytest.approx(2 * TRUE.frame_s(STEPS))
    fit_frame(bar, clock)
    fit_frame(bar, clock)
    assert bar._bar.n == pytest.approx(bar._bar.total)
    bar.close()


def source(run: Any) -> str:
    return forecast(stages(run.config, run.sequence, 1, 1)).source


def test_the_next_training_knows_from_its_beginning(clock: Clock, run: Any) -> None:
    assert "estimated from usual speeds of two cores; becomes exact" in price_line(run)
    bar = CostBar(run, STEPS)
    fit_frame(bar, clock)
    bar.close()
    assert expected(run) == TRUE
    run.ply_path(2).touch()
    line = price_line(run)
    whole = 3 * TRUE.frame_s(run.config.settings.iterations)
    assert line.startswith("3 frames to fit") and f"about {whole / 60:.0f} min" in line
    assert "as measured here before" in line
    other = SimpleNamespace(
        **{**vars(run), "config": SimpleNamespace(radio="uwb", settings=TrainConfig())}
    )
    assert "usual speeds of two cores scaled to this machine" in source(other)


def test_posing_people_is_part_of_the_price(clock: Clock, run: Any) -> None:
    def seconds(line: str) -> float:
        (word,) = re.findall(r"; about (\d+) s", line)
        return float(word)

    more = seconds(price_line(run, pose_stages(run, 8, 40, 2))) - seconds(price_line(run))
    found_s = 8 * 4 * costs.USUAL_FIND_S
    assert more == pytest.approx(found_s + 40 * costs.USUAL_LOOK_S, abs=1.0)


def test_counting_several_people_is_said_to_take_longer(run: Any) -> None:
    def seconds(instances: int) -> float:
        return forecast([count_stage(run.sequence, "wifi", 3, instances)]).total_s

    assert seconds(0) == pytest.approx(seconds(1))
    assert seconds(4) == pytest.approx(16 * seconds(1))


def test_a_damaged_note_stops_no_training(clock: Clock, run: Any, tmp_path: Path) -> None:
    bar = CostBar(run, STEPS)
    fit_frame(bar, clock)
    bar.close()
    for note in (tmp_path / "cache").rglob("*.json"):
        note.write_text("{")
    assert expected(run) == USUAL


@pytest.mark.filterwarnings("error")
def test_a_bar_whose_costs_do_not_add_up_ends_at_its_total(
    run: Any, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.004 s a stage are rounded away in the total, and still counted one by one."""
    monkeypatch.setattr(costs, "USUAL", Costs(0.004, 0.004, 0.0004))
    bar = CostBar(run, STEPS)
    for _ in run.frames:
        bar.begin("finding")
        bar.found("solving")
        bar.solved()
        for _ in range(STEPS):
            bar.step("refining")
        bar.finish_frame()
    assert bar._bar.n == bar._bar.total
    bar.close()


def test_a_step_of_the_papers_losses_costs_less_than_one_of_the_channel(run: Any) -> None:
    """By proportion to a step of the channel's loss its 10,000 steps were said to take 7 hours."""
    settings = TrainConfig.chosen(TrainOptions(recipe="paper"))
    config = SimpleNamespace(radio="wifi", settings=settings)
    taken_s = sum(
        stage.usual.step_s * stage.steps
        for stage in stages(config, run.sequence, 1, settings.iterations)
    )
    assert settings.num_gaussians == 100_000
    assert 15 * 60.0 < taken_s < 60 * 60.0
