# SPDX-License-Identifier: Apache-2.0
"""The gallery shows every scene, names who is strongest, and says so where ours loses."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from blender_scenes.catalogue import scenes
from rfgs_core import study
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.evaluate.metrics import evaluate_run
from rfgs_core.figures.clouds import FARTHEST_M, as_gaussians, camera_on, draw, floor_of
from rfgs_core.report.gallery import tile_of, tile_without_run, write_gallery
from rfgs_core.report.page import Tile, Verdict
from rfgs_core.study.cases import EVERY_SCENE, StudyScene
from rfgs_core.study.cells import make
from rfgs_core.study.gallery import SIZE, gallery_cells, ranked_baselines
from rfgs_core.study.paper_tables import Cell
from rfgs_core.view.browser import find_chromium, open_page

OneStep = Callable[[pytest.MonkeyPatch], None]


def f_scores(f10: float | None) -> dict[str, Any]:
    half = None if f10 is None else f10 / 2
    return {"geometry": {"f10": f10, "f05": half}, "rf": {}}


def methods_of(run: Any, **changes: float) -> dict[str, Any]:
    """What a cell's file says of an evaluated run."""
    metrics = json.loads((run.path / "metrics.json").read_text())
    return {"rfgs": metrics, **metrics["baselines"]} | {
        name: f_scores(value) for name, value in changes.items()
    }


def test_every_scene_of_ours_is_shown_once_by_a_radio_that_hears_it() -> None:
    chosen, ours = gallery_cells((), None), scenes()
    assert sorted(cell.scene for cell in chosen) == sorted(ours)
    assert {cell.method for cell in chosen} == {"rfgs"}
    radios = {cell.scene: cell.radio for cell in chosen}
    assert radios["corridor"] == "mmwave" and radios["through_wall"] == "wifi"
    assert [cell.name for cell in gallery_cells(["stairs"], "uwb")] == ["stairs-uwb-rfgs-seed0"]
    # Frames of our scenes are frames that they have.
    for scene in ours.values():
        first, last, _ = map(int, EVERY_SCENE[scene.name].frames.split(":"))
        assert scene.frame_start <= first < last <= scene.frame_end


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--scenes kitchen", "--scenes kitchen: expected some of living_room_walk, two_crossing"),
        ("--radio lidar", "unknown radio 'lidar'; expected one of"),
        ("--workers 0", "--workers 0: expected 1 to 256"),
    ],
)
def test_what_there_is_not_is_refused_before_anything_is_made(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "gallery", "--out", str(tmp_path / "out"), *words.split()]) == 2
    line = capsys.readouterr().err.strip()
    assert said in line and "\n" not in line
    assert not (tmp_path / "out").exists()


def test_a_page_does_not_replace_a_file(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "thesis").write_text("precious")
    assert main(["bench", "gallery", "--out", str(tmp_path / "thesis")]) == 2
    assert "is a file; expected a folder" in capsys.readouterr().err


def test_the_strongest_of_others_is_shown_whether_it_wins_or_not() -> None:
    silent = {"linear": f_scores(None), "zero": f_scores(0.0)}
    others = {"clean": f_scores(0.4), "gaussians_alone": f_scores(0.95), **silent}
    assert ranked_baselines({"rfgs": f_scores(0.8), **others}) == {"clean": 0.4}
    assert list(ranked_baselines({"rfgs": f_scores(0.8), **others, "omp": f_scores(0.9)})) == [
        "omp",
        "clean",
    ]
    assert ranked_baselines({"rfgs": f_scores(0.8), **silent}) == {}


@pytest.mark.parametrize(
    ("f10", "word", "text"),
    [
        (0.6, "Won", "RF-GS is 0.20 ahead within 10 cm, and 0.10 ahead within 5 cm."),
        (0.9, "Lost", "RF-GS is 0.10 behind within 10 cm, and 0.05 behind within 5 cm."),
        (0.801, "Level", "level within 10 cm; within 5 cm RF-GS is level."),
    ],
)
def test_a_tile_says_as_plainly_that_ours_loses(
    evaluated_run, f10: float, word: str, text: str
) -> None:
    methods = methods_of(evaluated_run, rfgs=0.8, template=f10)
    few = {name: methods[name] for name in ("rfgs", "template", "zero")} | {"omp": f_scores(0.1)}
    tile = tile_of(evaluated_run, few)
    assert (tile.verdict.word, tile.verdict.subcarrier) == (
        word, {"Won": "won", "Lost": "lost", "Level": "open"}[word]
    )  # fmt: skip
    assert text in tile.verdict.text
    _, ours, theirs = tile.panels
    said = "strongest of 2 baselines: a standing figure at our own place (template)"
    assert theirs.title == said
    # A phone breaks no number off its name.
    assert ours.score == "F10\u00a00.80, F5\u00a00.40"
    assert theirs.score.startswith(f"F10\u00a0{f10:.2f}")
    assert tile.frames == evaluated_run.frames and len(tile.tracks) == 3
    assert all(len(set(track)) == len(tile.frames) for track in tile.tracks)
    assert tile.about.startswith("One person. 2 frames, ") and "to depth" in tile.about


def opened(uri: str) -> np.ndarray:
    data = base64.b64decode(uri.removeprefix("data:image/webp;base64,"))
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGBA")).astype(int)


def test_pictures_of_a_tile_have_one_camera_and_one_scale_of_colours(surface_run) -> None:
    evaluate = replace(surface_run, shift_m=np.array([0.15, 0.0, 0.0]), frames=[1])
    evaluate.path.joinpath("config.json").write_text("{}")
    evaluate_run(evaluate, oracle=False)
    tile = tile_of(evaluate, methods_of(evaluate))
    truth, ours, theirs = (opened(panel.pictures[0]) for panel in tile.panels)
    assert truth.shape == ours.shape == theirs.shape
    solid = [picture[picture[..., 3] > 220] for picture in (truth, ours)]
    # What lies on the surface is blue, and what lies off it is redder.
    assert solid[0][:, 2].mean() > solid[0][:, 0].mean() + 20
    assert solid[1][:, 0].mean() > solid[0][:, 0].mean() + 20


def test_a_camera_has_all_of_the_truth_in_view_wherever_it_goes() -> None:
    rng = np.random.default_rng(0)
    for size in ((8.0, 0.5, 1.7), (0.5, 0.5, 1.7), (3.0, 9.0, 2.0)):
        points = rng.uniform(0.0, 1.0, (500, 3)) * size + (5.0, -3.0, 0.0)
        camera = camera_on(points)
        pixels, depth = camera.project(points)
        assert depth.min() > 1.0
        assert np.all((pixels > 0) & (pixels < (camera.width, camera.height)))
        # And no farther away than that takes.
        extent = np.ptp(pixels, axis=0) / (camera.width, camera.height)
        assert extent.max() > 0.7
        # Up is up.
        up = camera.project(points + np.array([0.0, 0.0, 0.1]))[0] - pixels
        assert np.all(up[:, 1] < 0.0) and np.abs(up[:, 0]).max() < 3.0


def test_points_out_of_sight_leave_the_floor() -> None:
    points = np.random.default_rng(1).uniform(0.0, 1.0, (300, 3))
    camera = camera_on(points)
    floor = floor_of(np.array([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]]), camera)
    assert np.asarray(floor)[..., 3].max() > 50
    nothing = draw(as_gaussians(np.zeros((0, 3)), 0.04), points, camera, floor)
    assert np.array_equal(np.asarray(nothing), np.asarray(floor))
    above = points + np.array([0.0, 0.0, 2.0 * FARTHEST_M])
    far = draw(as_gaussians(above, 0.04), points, camera, floor)
    assert not np.array_equal(np.asarray(far), np.asarray(floor))


def policy_of(html: str) -> dict[str, str]:
    policy = unescape(re.search(r'Content-Security-Policy" content="([^"]*)"', html)[1])
    return dict(part.strip().split(" ", 1) for part in policy.split(";"))


def test_the_page_is_whole_and_may_load_and_run_nothing_else(evaluated_run, tmp_path: Path) -> None:
    tile = tile_of(evaluated_run, methods_of(evaluated_run))
    write_gallery(tmp_path / "gallery.html", [tile], "rfgs bench gallery")
    html = (tmp_path / "gallery.html").read_text("utf-8")
    policy = policy_of(html)
    assert policy["default-src"] == "'none'" and policy["img-src"] == "data:"
    for kind in ("style", "script"):
        (text,) = re.findall(rf"<{kind}>(.*?)</{kind}>", html, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert policy[f"{kind}-src"] == f"'sha256-{digest}'"
    # Such a policy lets no attribute style or run anything either.
    assert not re.search(r"<[^>]* (style|on\w+)=", html)
    assert not re.search(r"(https?:)?//", re.sub(r"data:image/\w+;base64,[\w+/=]+", "", html))
    assert html.count("<img") == html.count(" alt=") == 4
    data = json.loads(unescape(re.search(r"data-player='([^']*)'", html)[1]))
    assert data["frames"] == evaluated_run.frames and len(data["tracks"]) == 3
    assert "1 scenes" not in html and "1 scene," in html


def test_a_scene_without_people_says_so(tiny_dataset: Path, monkeypatch) -> None:
    vehicles = [{"id": 1, "name": "van", "class": "vehicle", "nominal_surface_m2": 20.0}]
    rows = [*vehicles, {"id": 2, "name": "door", "class": "static", "nominal_surface_m2": None}]
    sequence = type(open_dataset(tiny_dataset).sequence())
    monkeypatch.setattr(sequence, "instances", rows)
    tile = tile_without_run("street", "wifi", tiny_dataset, "nobody is heard")
    assert tile.about.startswith("No person, one vehicle. 2 frames")
    # The truth is shown all the same.
    assert len(tile.tracks) == 1 and len(tile.tracks[0]) == 2
    assert tile.verdict == Verdict("open", "No answer", "nobody is heard")
    monkeypatch.setattr(sequence, "instances", [])
    assert tile_without_run("x", "wifi", tiny_dataset, "").about.startswith("Nothing moves.")


def test_a_scene_without_a_dataset_has_a_tile_that_says_why(tmp_path: Path) -> None:
    tile = tile_without_run("street", "mmwave", tmp_path / "nowhere", "paths reach too far")
    assert tile.tracks == [] and tile.verdict.text == "paths reach too far"
    write_gallery(tmp_path / "page.html", [tile], "rfgs bench gallery")
    html = (tmp_path / "page.html").read_text("utf-8")
    assert "paths reach too far" in html and 'class="player"' not in html


def test_a_hostile_name_stays_text(tmp_path: Path) -> None:
    hostile = "\"><script>alert(1)</script>' onload=x"
    verdict = Verdict("open", "No answer", hostile)
    tile = Tile(hostile, hostile, hostile, [], [], [], verdict)
    write_gallery(tmp_path / "page.html", [tile], hostile)
    html = (tmp_path / "page.html").read_text("utf-8")
    assert "alert(1)" in html and html.count("<script>") == 1
    assert not re.search(r"<[^>]*[\"'] onload", html)


def test_a_cell_of_other_frames_is_refused(tiny_dataset: Path, tmp_path: Path) -> None:
    cell = Cell("corridor", "wifi", "rfgs", 0)
    shutil.copytree(tiny_dataset, tmp_path / cell.dataset)
    with pytest.raises(RfgsError, match=r"expected frames \[5, 15, .*found \[1, 2\]; delete it"):
        make(cell, tmp_path, SIZE)


@pytest.fixture
def tiny_scenes(
    tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, one_step: OneStep
) -> Path:
    """A folder with the datasets of two scenes, one of them damaged; trainings are short."""
    one_step(monkeypatch)
    whole = study.cells.train_config
    monkeypatch.setattr(
        study.cells,
        "train_config",
        lambda cell, size: replace(
            whole(cell, size), posture="standing", num_gaussians=200, limbs="off"
        ),
    )
    monkeypatch.setitem(EVERY_SCENE, "living_room_walk", StudyScene("1:2", radio="wifi"))
    shutil.copytree(tiny_dataset, tmp_path / "data/living_room_walk-wifi")
    (tmp_path / "data/corridor-mmwave").mkdir()
    (tmp_path / "data/corridor-mmwave/dataset.json").write_text("{}")
    return tmp_path


@pytest.mark.slow
def test_the_command_keeps_what_is_finished_and_shows_what_failed(
    tiny_scenes: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["bench", "gallery", "--out", str(tiny_scenes), "--scenes"]
    assert main([*command, "living_room_walk", "corridor"]) == 1
    said = capsys.readouterr().out
    assert "gallery.html written" in said and "corridor-mmwave-rfgs-seed0: data/corridor" in said
    html = (tiny_scenes / "gallery.html").read_text("utf-8")
    assert html.count('class="player"') == 1 and str(tiny_scenes) not in html
    (cell,) = (tiny_scenes / "cells").iterdir()
    made = cell.stat().st_mtime_ns
    assert main([*command, "living_room_walk"]) == 0
    assert cell.stat().st_mtime_ns == made
    assert "<td>rfgs bench gallery --scenes living_room_walk</td>" in (
        tiny_scenes / "gallery.html"
    ).read_text("utf-8")
    # The strongest is that of the cell's own file.
    baseline = next(iter(ranked_baselines(json.loads(cell.read_text())["methods"])))
    assert f"({baseline})" in (tiny_scenes / "gallery.html").read_text("utf-8")


@pytest.mark.slow
def test_the_page_plays_pauses_and_fits_a_phone(evaluated_run, tmp_path: Path) -> None:
    try:
        find_chromium()
    except MissingToolError as error:
        pytest.skip(str(error))
    tile = tile_of(evaluated_run, methods_of(evaluated_run))
    write_gallery(tmp_path / "gallery.html", [tile], "rfgs bench gallery")
    shown = "[...document.querySelectorAll('.player img')].map(one => one.src.slice(-60))"
    with open_page((tmp_path / "gallery.html").as_uri(), 420, 900) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == 420
        first = page.evaluate(shown)
        # The page's own policy lets no string be run, which waiting for a condition would take.
        while (now := page.evaluate(shown)) == first:
            page.wait_for_timeout(50)
        # All three go on together.
        assert all(one != then for one, then in zip(now, first, strict=True))
        page.click(".all")
        held = page.evaluate(shown)
        page.wait_for_timeout(1500)
        assert page.evaluate(shown) == held and page.inner_text(".player button") == "Play"
        page.emulate_media(reduced_motion="reduce")
        page.reload()
        assert page.inner_text(".all") == "Play all"
