# SPDX-License-Identifier: Apache-2.0
"""Values out of JSON as types: a mistake is its place, what is expected and what was found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pytest

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.records import read_record, record, unknown_fields


@dataclass(frozen=True)
class Part:
    size_m: tuple[float, float]
    kind: Literal["wall", "floor"] = "wall"
    name: str | None = None


@dataclass(frozen=True)
class Whole:
    count: int
    parts: list[Part] = field(default_factory=list)
    by_name: dict[str, list[int]] = field(default_factory=dict)
    on: bool = False


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ([], "expected an object, found []"),
        (None, "expected an object, found null"),
        ({}, "field 'count' is missing"),
        ({"count": "3"}, "count: expected a whole number, found '3'"),
        ({"count": 3.5}, "count: expected a whole number, found 3.5"),
        ({"count": True}, "count: expected a whole number, found true"),
        ({"count": 1, "on": 1}, "on: expected true or false, found 1"),
        ({"count": 1, "parts": {}}, "parts: expected a list, found an object"),
        ({"count": 1, "parts": [{}]}, "parts[0]: field 'size_m' is missing"),
        ({"count": 1, "parts": [{"size_m": [1]}]}, "parts[0].size_m: expected a list of length 2"),
        (
            {"count": 1, "parts": [{"size_m": [1, None]}]},
            "[1]: expected a number, found null",
        ),
        (
            {"count": 1, "parts": [{"size_m": [1, 2], "kind": "roof"}]},
            "parts[0].kind: expected floor or wall, found 'roof'",
        ),
        (
            {"count": 1, "parts": [{"size_m": [1, 2], "name": 7}]},
            "parts[0].name: expected text or null, found 7",
        ),
        ({"count": 1, "by_name": {"a": ["x" * 500]}}, "expected a whole number, found"),
    ],
)
def test_a_mistake_is_told_by_place_expected_and_found(value: Any, said: str) -> None:
    with pytest.raises(RfgsFormatError) as caught:
        record("here.json", value, Whole, "make it again")
    text = str(caught.value)
    assert text.startswith("here.json: ") and text.endswith("; make it again")
    assert said in text and "\n" not in text and len(text) < 200


def test_what_fits_is_taken_and_whole_numbers_are_numbers() -> None:
    value = {"count": 2, "parts": [{"size_m": [1, 2.5], "colour": "red"}], "more": 1}
    assert record("x", value, Whole) == Whole(2, [Part((1.0, 2.5))])
    assert unknown_fields(value, Whole) == ["more"]


def test_numbers_in_quotes_only_where_they_are_asked_for() -> None:
    row = {"size_m": ["1e3", 2]}
    assert record("x", row, Part, lax=True).size_m == (1000.0, 2.0)
    with pytest.raises(RfgsFormatError, match="expected a number, found '1e3'"):
        record("x", row, Part)
    for strange in ("nan", "inf", "-Infinity", float("nan")):
        with pytest.raises(RfgsFormatError, match="size_m: expected a finite number, found"):
            record("x", {"size_m": [strange, 1]}, Part, lax=True)


@pytest.mark.parametrize(
    "text", ["", "{", "NaN", '{"seed": Infinity}', "1e999", "[1] 2", "\udcff", "[" * 10**5]
)
def test_json_that_is_none_is_one_line(tmp_path: Path, text: str) -> None:
    file = tmp_path / "a.json"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(RfgsFormatError, match=r"a\.json: expected JSON, got something else"):
        read_json(file)


def test_a_missing_and_a_giant_file_are_named(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file"):
        read_record(tmp_path / "a.json", Whole)
    with (tmp_path / "a.json").open("wb") as stream:
        stream.truncate(2**26)
    with pytest.raises(RfgsFormatError, match="larger than any JSON file of ours"):
        read_record(tmp_path / "a.json", Whole)
