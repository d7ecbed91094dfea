# SPDX-License-Identifier: Apache-2.0
"""How many people a run is about, and how that is known."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.evaluate.head_count import empty_room_anew, head_count_table, noise_alone
from rfgs_core.measure.observations import observe
from rfgs_core.run import people as run_people
from rfgs_core.run.people import (
    PEOPLE_FILE,
    HeadCount,
    People,
    counted,
    decided,
    head_count,
    told,
    voted,
)
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig


@pytest.mark.parametrize(
    ("votes", "count"),
    [([1], 1), ([0, 0, 1], 0), ([2, 1, 2, 3], 2), ([1, 2, 2, 1], 2), ([3, 1], 3)],
)
def test_most_frames_decide_and_of_equals_the_larger(votes: list[int], count: int) -> None:
    assert voted(votes) == count


def test_votes_that_are_not_asked_would_change_nothing() -> None:
    """All ballots of five frames on nobody, one or two."""
    early = 0
    for ballot in itertools.product(range(3), repeat=5):
        asked = next((n for n in range(1, 5) if decided(list(ballot[:n]), 5)), 5)
        assert voted(list(ballot[:asked])) == voted(list(ballot))
        early += asked == 3
    assert early == 3 * 3**2
    assert not decided([1, 1], 5) and decided([1, 1, 1], 5) and not decided([1, 1, 1, 2], 7)


def test_frames_are_asked_until_most_agree(
    tiny_dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @dataclass(frozen=True)
    class Seen:
        frame: int
        path_m: float = 0.0

        def lengthened(self, path_m: float) -> Seen:
            return Seen(self.frame, path_m)

    sequence, asked = open_dataset(tiny_dataset).sequence(), []
    monkeypatch.setattr(run_people, "observe", lambda _sequence, _radio, frame, *_: Seen(frame))
    monkeypatch.setattr(run_people, "count_bodies", lambda seen, *_: asked.append(seen) or [None])
    monkeypatch.setattr(run_people, "why_not_sensed", lambda *_: None)
    config = TrainConfig(excess_m=0.9)
    heads = head_count(sequence, "wifi", list(range(1, 10)), config, "sensed")
    # People are counted with the wall taken off.
    assert asked == [Seen(5, -0.9), Seen(1, -0.9), Seen(9, -0.9)]
    assert heads == HeadCount(1, "sensed", {"5": 1, "1": 1, "9": 1})


def test_what_is_kept_is_read(tmp_path: Path) -> None:
    heads = HeadCount(2, "sensed", {"1": 2, "5": 1, "9": 2})
    heads.write(tmp_path)
    assert HeadCount.read(tmp_path) == heads
    assert str(heads) == "2, sensed (2 of 3 frames)"
    assert str(HeadCount(3, "asked")) == "3, asked"


def test_a_damaged_count_is_refused_and_a_missing_one_is_none(tmp_path: Path) -> None:
    assert HeadCount.read(tmp_path) is None
    (tmp_path / PEOPLE_FILE).write_text('{"count": "many", "source": "sensed", "votes": {}}')
    with pytest.raises(RfgsFormatError, match="count"):
        HeadCount.read(tmp_path)


def test_people_are_sensed_told_or_asked_for(tiny_dataset: Path) -> None:
    sequence, config = open_dataset(tiny_dataset).sequence(), TrainConfig()
    assert head_count(sequence, "wifi", [1], config, "sensed") == HeadCount(1, "sensed", {"1": 1})
    assert head_count(sequence, "wifi", [1], config, "told") == HeadCount(told(sequence), "told")
    assert head_count(sequence, "wifi", [1], config, 4) == HeadCount(4, "asked")


def test_counting_says_its_price_first_and_only_where_people_are_sensed(
    tiny_dataset: Path, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What is said does not depend on who is found.
    monkeypatch.setattr(run_people, "count_bodies", lambda *_: [None])
    sequence, config = open_dataset(tiny_dataset).sequence(), TrainConfig()
    for asked, lines in (("told", 0), (2, 0), ("sensed", 1)):
        counted(tmp_path / "run", sequence, "wifi", sequence.frames, config, asked)
        said = capsys.readouterr().err
        assert said.count("counting people in up to 2 frames first: about ") == lines
    assert "does without" in said


def test_without_phases_people_are_told(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    config = replace(TrainConfig(), observe="power")
    assert head_count(sequence, "wifi", [1], config).source == "told"
    with pytest.raises(RfgsError, match="power has no phases; expected --people told"):
        head_count(sequence, "wifi", [1], config, "sensed")


def test_nobody_at_all_cannot_be_asked_for(tiny_dataset: Path) -> None:
    with pytest.raises(RfgsError, match="--people 0: expected at least 1"):
        head_count(open_dataset(tiny_dataset).sequence(), "wifi", [1], TrainConfig(), 0)


def test_a_run_keeps_its_number_and_refuses_another(
    tiny_dataset: Path, tmp_path: Path, quick_config: TrainConfig
) -> None:
    data, out = open_dataset(tiny_dataset), tmp_path / "run"

    def train(people: People) -> int:
        run = train_sequence(
            data, data.sequence(), "wifi", [1], replace(quick_config, limbs="off"), out,
            people=people,
        )  # fmt: skip
        return run.config.settings.bodies

    assert train(2) == 2
    assert HeadCount.read(out) == HeadCount(2, "asked")
    assert train("auto") == 2
    with pytest.raises(RfgsError, match="another bodies"):
        train(3)


def test_nobody_is_counted_where_nobody_is(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    seen = observe(sequence, "wifi", 1)
    for control in (noise_alone, empty_room_anew):
        hidden = ~(seen.links[..., None] & seen.subcarriers)
        assert not control(seen, 0).delta[hidden].any()
    table = head_count_table(sequence, "wifi", [1])
    assert (table["right"], table["over"], table["under"]) == (1, 0, 0)
    assert table["noise alone"] == table["empty room heard anew"] == 0.0
    # A single frame has no other one that could confirm it.
    assert "confirmed by another frame" not in table
