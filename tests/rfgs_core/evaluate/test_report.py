# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import base64
import io
import json
import re
import shutil
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rfgs_core.cli.compare import CompareArgs
from rfgs_core.cli.compare import run as compare
from rfgs_core.errors import MissingToolError, RfgsError, RfgsFormatError
from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.pictures import has_pictures
from rfgs_core.figures.shapes import colouring
from rfgs_core.render.view import pictures_of
from rfgs_core.report import write_demo_report, write_run_report
from rfgs_core.report.build import _views
from rfgs_core.report.cards import WORDS, headline_cards, in_words
from rfgs_core.report.metrics_file import read_metrics
from rfgs_core.report.tables import metric_tables, show, text_table
from rfgs_core.run.config import RunConfig
from rfgs_core.seals import write_sealed_json
from rfgs_core.view.browser import find_chromium, open_page

HEADINGS = (
    "What the radio measures",
    "Gaussians beside the true mesh",
    "Rendered beside true views",
    "Every metric beside its baselines",
    "Resolution limits",
    "Conditions",
    "Time of each stage",
    "Provenance",
)


def assert_whole(html: str) -> None:
    for heading in HEADINGS:
        assert heading in html, heading
    # Text only: base64 may hold any letters.
    text = re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]+", "", html)
    assert not re.search(r"\b(nan|None|inf|undefined)\b", text)
    assert not re.search(r"(src|href)=\"(https?:)?//", text)
    assert text.count("<table") == text.count("</table>")


def test_run_report_has_every_section_and_nothing_missing(evaluated_run) -> None:
    html = write_run_report(evaluated_run).read_text("utf-8")
    assert_whole(html)
    assert html.count("data:image/png") >= 4 + 4
    for name in ("matched_filter", "template", "oracle_init", "silhouette", "nearest_element"):
        assert name in html
    assert "loses to" in html


#: Lines that the value of each row takes whose words hold a number and a unit.
LINES = """[...document.querySelectorAll('table.facts td')]
    .filter(cell => /^[\\d.]+ (m|s|min \\d+ s)$/.test(cell.textContent.trim()))
    .map(cell => { const range = document.createRange(); range.selectNodeContents(cell);
                   return new Set([...range.getClientRects()].map(box => box.top)).size })"""


@pytest.mark.slow
def test_a_phone_scrolls_down_only_and_breaks_no_short_value(evaluated_run) -> None:
    try:
        find_chromium()
    except MissingToolError as error:
        pytest.skip(str(error))
    page_file = write_run_report(evaluated_run)
    with open_page(page_file.as_uri(), 420, 900) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == 420
        lines = page.evaluate(LINES)
    assert len(lines) >= 3 and set(lines) == {1}


def test_demo_report_shows_runs_times_and_the_blender_picture(
    evaluated_run, tmp_path: Path
) -> None:
    demo = tmp_path / "demo"
    demo.mkdir()
    (demo / "inspect.png").write_bytes(b"\x89PNG")
    path = write_demo_report(demo, [evaluated_run], {"generate": 75.2, "train wifi": 12.0})
    html = path.read_text("utf-8")
    assert_whole(html)
    assert path == demo / "report.html"
    assert "1 min 15 s" in html and "train wifi" in html
    assert "imported into Blender" in html


def test_report_before_evaluation_says_what_to_do(surface_run) -> None:
    surface_run.path.joinpath("config.json").write_text("{}")
    with pytest.raises(RfgsError, match="rfgs eval"):
        write_run_report(surface_run)


def test_pictures_of_training_alone_are_no_views(surface_run, monkeypatch) -> None:
    """As of a dataset with one camera, when a single frame was trained on."""
    whole = surface_run.sequence.splits["images"]
    seen = {name: [] for name in whole if name.startswith("test")}
    monkeypatch.setitem(surface_run.sequence.splits, "images", {**whole, **seen})
    assert has_pictures(surface_run) and not pictures_of(surface_run, "test")
    assert _views(surface_run) == []


@pytest.mark.parametrize(
    ("people", "value", "note"),
    [
        ({"centroid_m": None, "found": 0.0}, "–", "0 % of the people are found"),
        ({"centroid_m": None, "found": None}, "5 cm", "in 100 % of the frames"),
        ({"centroid_m": 0.12, "found": 1.0}, "12 cm", "100 % of the people are found"),
    ],
)
def test_a_place_is_told_or_its_lack(evaluated_run, people, value, note) -> None:
    metrics = json.loads((evaluated_run.path / "metrics.json").read_text())
    metrics["geometry"] |= {"centroid_m": 0.05, "tracked": 1.0}
    card = headline_cards({**metrics, "people": people})[2]
    assert (card.value, note in card.note) == (value, True)


def test_radios_without_unseen_elements_have_no_card_of_them(evaluated_run) -> None:
    """Arrays of two columns hold none out, so nobody is measured on any."""
    metrics = json.loads((evaluated_run.path / "metrics.json").read_text())
    assert any("antennas it never heard" in card.label for card in headline_cards(metrics))
    for part in (metrics, *metrics["baselines"].values()):
        part["rf"]["element_snr_db"] = None
    assert not any("antennas it never heard" in card.label for card in headline_cards(metrics))


def test_cards_compare_with_the_strongest_baseline_whichever_it_is(evaluated_run) -> None:
    metrics = json.loads((evaluated_run.path / "metrics.json").read_text())
    metrics["geometry"]["f10"] = 0.80
    for name in ("omp", "body_prior", "clean", "oracle_init"):
        for part in metrics["baselines"].values():
            if (part.get("geometry") or {}).get("f10") is not None:
                part["geometry"]["f10"] = 0.5
        metrics["baselines"].setdefault(name, {}).setdefault("geometry", {})["f10"] = 0.9
        card = headline_cards(metrics)[0]
        assert card.value == "80 %" and "within 10 cm" in card.label
        if name == "oracle_init":  # the ceiling is no competitor
            assert card.subcarrier == "won" and "strongest baseline: 50 %" in card.note
            assert "started on the truth: 90 %" in card.note
        else:
            assert card.subcarrier == "lost"
            assert f"strongest baseline: 90 %, {WORDS[name]} ({name})" in card.note
    assert set(BASELINES) <= set(WORDS), "every baseline has words"


def test_names_of_baselines_stand_behind_what_they_do() -> None:
    text = in_words("F10 0.8 against 0.6 of matched_filter and template_filled (0.9); 1 of linear.")
    assert text == (
        "match within 10 cm (F10) 0.8 against 0.6 of a plain radar image (matched_filter) and a "
        "solid standing figure at our own place (template_filled) (0.9); 1 of a straight line "
        "between antennas (linear)."
    )


def test_colours_of_shapes_say_something_whether_powers_differ_or_not() -> None:
    surface = np.zeros((1, 3))
    means = np.array([[0.0, 0.0, 0.05], [0.0, 0.1, 0.0]])
    alike = colouring(means, np.zeros(2), surface)
    assert alike.label == "distance to the true surface [cm]"
    assert alike.values == pytest.approx([5.0, 10.0]) and alike.low == 0.0
    apart = colouring(means, np.array([-6.0, 0.0]), surface)
    assert apart.label.startswith("reflected power") and apart.values[0] == -6.0
    assert -6.0 <= apart.low < apart.high <= 0.0
    assert len(colouring(means[:0], np.zeros(0), surface).values) == 0


def test_the_player_holds_every_frame_true_and_fitted(evaluated_run) -> None:
    html = write_run_report(evaluated_run).read_text("utf-8")
    data = json.loads(unescape(re.search(r"data-player='([^']*)'", html)[1]))
    assert data["frames"] == evaluated_run.frames
    assert len(data["tracks"]) == 2
    for track in data["tracks"]:
        assert len(track) == len(evaluated_run.frames) == len(set(track))
    camera = re.search(r"<p class=\"quiet\">(cam\d+), ", html)[1]
    picture = base64.b64decode(data["tracks"][0][1].removeprefix("data:image/jpeg;base64,"))
    shown = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
    true = evaluated_run.sequence.image(camera, evaluated_run.frames[1])[..., :3]
    assert np.abs(shown - true).mean() < 8


def test_tables_mark_the_best_and_say_who_wins(evaluated_run) -> None:
    metrics = json.loads((evaluated_run.path / "metrics.json").read_text())
    geometry = metric_tables(metrics)[0]
    assert geometry.rows[0].kind == "method"
    assert geometry.rows[0].cells[1].best
    rf = metric_tables(metrics)[1]
    assert any("loses to" in line for line in rf.losses) == (not rf.rows[0].cells[0].best)
    assert "F10" in text_table(metrics)


def test_what_looks_equal_is_no_loss_and_baselines_keep_their_order(evaluated_run) -> None:
    metrics = json.loads((evaluated_run.path / "metrics.json").read_text())
    metrics["geometry"]["f10"] = 0.70000
    metrics["baselines"]["clean"]["geometry"]["f10"] = 0.70001
    metrics["baselines"]["omp"]["geometry"]["f10"] = 0.8
    table = metric_tables(metrics)[0]
    line = next(line for line in table.losses if line.startswith("F10:"))
    assert "omp (0.800)" in line and "clean" not in line
    labels = [row.label for row in table.rows]
    assert labels[:3] == ["RF-GS", "zero", "empty_room"]
    assert labels[-1] == "oracle_init"


def test_missing_numbers_are_dashes_and_minus_signs_are_true() -> None:
    assert show(None, 2) == "–"
    assert show(-1.25, 1) == "−1.2"


def test_compare_prints_and_writes_both_kinds(evaluated_run, tmp_path: Path, capsys) -> None:
    other = tmp_path / "other"
    other.mkdir()
    for name in ("config.json", "metrics.json"):
        shutil.copy(evaluated_run.path / name, other / name)
    metrics = json.loads((other / "metrics.json").read_text())
    metrics["geometry"]["f10"] = 0.1
    metrics["conditions"]["radio"] = "mmwave"
    write_sealed_json(other / "metrics.json", metrics)
    for suffix in ("md", "html"):
        out = tmp_path / f"table.{suffix}"
        assert compare(CompareArgs(evaluated_run.path, other, out)) == 0
        assert "geometry.f10" in out.read_text("utf-8")
    text = capsys.readouterr().out
    assert "Not the same conditions: radio: wifi against mmwave" in text
    row = next(line for line in text.splitlines() if line.startswith("geometry.f10 "))
    assert row.endswith(evaluated_run.path.name)
    assert text.count("Not the same conditions") == 2
    (other / "metrics.json").write_text("[]")
    with pytest.raises(RfgsFormatError, match=r"metrics\.json: expected an object"):
        compare(CompareArgs(evaluated_run.path, other))


def test_compare_names_other_frames_and_another_dataset(
    evaluated_run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As many frames of the same scene, but others, or traced anew, are another task."""
    other = Path(shutil.copytree(evaluated_run.path, tmp_path / "other"))
    metrics = read_metrics(other)
    for row in metrics["frames"]:
        row["frame"] += 7
    write_sealed_json(other / "metrics.json", metrics)
    replace(RunConfig.read(other), dataset_fingerprint="f" * 64).write(other)
    assert compare(CompareArgs(evaluated_run.path, other)) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Not")]
    assert notes == [
        "Not the same conditions: frames: 1, 2 against 8, 9",
        "Not the same conditions: dataset, by its fingerprint: aaaaaaaaaaaa against ffffffffffff",
    ]


@pytest.mark.parametrize("make", [False, True])
def test_compare_refuses_what_is_no_evaluated_run(
    evaluated_run, tmp_path: Path, make: bool
) -> None:
    other = tmp_path / "not_a_run"
    other.mkdir()
    if make:
        (other / "config.json").write_text("{}")
    with pytest.raises(RfgsError, match="rfgs eval" if make else "config.json"):
        compare(CompareArgs(evaluated_run.path, other))


def test_compare_refuses_other_file_types(evaluated_run, tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match=r"\.md or \.html"):
        compare(CompareArgs(evaluated_run.path, evaluated_run.path, tmp_path / "table.pdf"))
