# SPDX-License-Identifier: Apache-2.0
"""The card itself: what holds, what misses, and how it is told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dataset_factory import cli, verify
from dataset_factory.verify import box
from dataset_factory.verify.card import Card, Curve, Group, Plot, at_least, near, within
from dataset_factory.verify.report import as_html, as_markdown, as_text, summary, write_card
from dataset_factory.verify.workshop import Workshop
from rfgs_core.errors import RfgsError

GOOD = near("exponent", 2.0, 2.001, 0.02, "", "theory")
BAD = near("level of a | b", -6.0, -5.5, 0.1, "dB", "theory")
PLOT = Plot(
    "A line",
    "x [m]",
    "y [dB]",
    [
        Curve("theory", np.arange(3.0), np.arange(3.0), "closed form"),
        Curve("found", np.arange(3.0), np.array([0.0, np.nan, 2.0]), "measured"),
    ],
    tolerance=0.1,
)


def card(*rows) -> Card:
    return Card([Group("space", "Free <space>", "Words.", rows, [PLOT], 75.0)], [("Date", "today")])


def test_rows_hold_within_their_tolerance_alone() -> None:
    assert GOOD.ok and not BAD.ok
    assert near("edge", 0.0, 0.5, 0.5, "dB", "").ok
    assert within("error", -63.0, -40.0, "dB", "").ok and not within("e", -39.0, -40.0, "", "").ok
    assert at_least("overlap", 0.995, 0.99, "").ok and not at_least("o", 0.98, 0.99, "").ok
    assert not near("lost", 0.0, float("nan"), 1.0, "", "").ok


def test_misses_are_named() -> None:
    assert card(GOOD).missed == []
    assert card(GOOD, BAD).missed == ["space: level of a | b"]
    assert summary(card(GOOD)) == "1 of 1 rows hold."
    assert "Missed: space: level of a | b." in summary(card(GOOD, BAD))


def test_every_form_of_the_card_says_the_same(tmp_path: Path) -> None:
    found = card(GOOD, BAD)
    text, page, markdown = as_text(found), as_html(found), as_markdown(found)
    for said in (text, page, markdown):
        assert "MISSED" in said and "-5.5 dB" in said and "0.1 dB" in said
    assert "Free &lt;space&gt;" in page and page.count("data:image/png;base64,") == 1
    assert "http" not in page.split("<body>")[1]
    assert "level of a \\| b" in markdown and "| Date | today |" in markdown
    write_card(found, tmp_path / "new")
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == [
        "card.json",
        "index.html",
        "physics.md",
    ]
    stored = json.loads((tmp_path / "new" / "card.json").read_text("utf-8"))
    assert stored["missed"] == found.missed
    assert stored["groups"][0]["plots"][0]["curves"][1]["y"] == [0.0, None, 2.0]


def test_unknown_group_is_refused_with_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["verify", "--only", "friis", "gravity"]) == 2
    error = capsys.readouterr().err
    assert "no group 'gravity'" in error and "friis, box, reciprocity" in error
    with pytest.raises(RfgsError, match="gravity"):
        verify.chosen_groups(("gravity",))
    assert verify.chosen_groups(("box", "friis")) == ["friis", "box"]


def test_help_names_every_group(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        cli.main(["verify", "--help"])
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert all(name in said for name in verify.GROUPS)


def test_command_builds_traces_and_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, page = tmp_path / "physics", tmp_path / "docs" / "physics.md"
    code = cli.main(["verify", "--only", "energy", "--out", str(out), "--markdown", str(page)])
    said = capsys.readouterr()
    assert code == 0, said
    assert "2 of 2 rows hold." in said.out and "energy" in said.err
    assert page.read_bytes() == (out / "physics.md").read_bytes()
    assert not list(out.glob(".tmp-*")), "what was built stays behind"


def test_command_fails_where_a_row_misses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A group like any other, found by its name in the list of groups."""
    (tmp_path / "off_by_half.py").write_text(
        "from dataset_factory.verify.card import Group, near\n"
        "def verify(workshop):\n"
        "    row = near('level', -6.0, -5.5, 0.1, 'dB', 'theory')\n"
        "    return Group('off', 'Off', 'Words.', [row])\n"
    )
    monkeypatch.setattr(verify, "__path__", [*verify.__path__, str(tmp_path)])
    monkeypatch.setitem(verify.GROUPS, "off_by_half", 1.0)
    assert cli.main(["verify", "--only", "off_by_half", "--out", str(tmp_path / "out")]) == 1
    assert "Missed: off: level." in capsys.readouterr().err
    assert "MISSED" in (tmp_path / "out" / "physics.md").read_text("utf-8")


@pytest.mark.slow
def test_a_wall_moved_by_a_centimetre_is_seen(tmp_path: Path) -> None:
    x, y, z = box.CONCRETE.size_m
    moved = replace(box.CONCRETE, size_m=(x + 0.01, y, z))
    group = box.verify(Workshop(tmp_path), moved)
    concrete = [row for row in group.rows if not row.name.startswith("plasterboard")]
    held = {row.name for row in concrete if row.ok}
    assert held == {"paths of up to three reflections"}


@pytest.mark.slow
def test_scenes_that_cannot_be_built_are_told(tmp_path: Path) -> None:
    wrong = box.scene(replace(box.CONCRETE, material="cheese"))
    with pytest.raises(RfgsError, match="could not be built"):
        Workshop(tmp_path).bundle(wrong)
    assert not list(tmp_path.glob("*.blend"))
