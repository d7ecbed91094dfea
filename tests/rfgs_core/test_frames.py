# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.frames import chosen_frames, listed, parse_frames


def test_parsed_frames_include_both_ends() -> None:
    assert list(parse_frames("10:45:5")) == [10, 15, 20, 25, 30, 35, 40, 45]
    assert list(parse_frames("-1:1")) == [-1, 0, 1]
    assert list(parse_frames("7")) == [7]
    for text in ("", "1:2:0", "a:b", "1:2:3:4", "3:1"):
        with pytest.raises(RfgsError):
            parse_frames(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (None, [10, 15, 20, 25, 30]),
        ("15", [15]),
        ("10:20", [10, 15, 20]),
        ("11:26", [15, 20, 25]),
        ("10:30:10", [10, 20, 30]),
        ("12:30:3", [15, 30]),
        ("30:99", [30]),
        ("-5:10", [10]),
    ],
)
def test_chosen_frames(text: str | None, expected: list[int]) -> None:
    assert chosen_frames(text, [10, 15, 20, 25, 30]) == expected


@pytest.mark.parametrize(
    "text", ["", "a", "1:", "1:2:0", "1:2:-1", "1:2:3:4", "1.5", "12", "20:10", "1_0", "١"]
)
def test_frames_that_mean_nothing_are_refused(text: str) -> None:
    with pytest.raises(RfgsError, match=f"--frames {text!r}:"):
        chosen_frames(text, [10, 15, 20])


def test_messages_name_the_frames_there_are() -> None:
    assert listed([10, 18, 26, 34, 42]) == "10, 18, 26, 34, 42"
    assert listed(range(3, 600, 3)) == "3, 6, 9, 12, 15, 18, 21, 24, 27, 30, …, 597 (199 frames)"
