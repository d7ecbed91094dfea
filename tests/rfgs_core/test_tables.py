# SPDX-License-Identifier: Apache-2.0
"""The paper's tables have every method once, keep what is finished, and say what the cells say."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from rfgs_core import study
from rfgs_core.cli import main
from rfgs_core.errors import RfgsError
from rfgs_core.files import read_json
from rfgs_core.neural.direct_sum import SumSettings
from rfgs_core.neural.signal_splat import SplatSettings
from rfgs_core.study.ablation import VARIANTS
from rfgs_core.study.cell_rows import leaks, method_rows, method_table, strongest
from rfgs_core.study.cells import make, settings_of, stored
from rfgs_core.study.paper_tables import (
    CHANNEL_FIELDS,
    FIELDS,
    SIZES,
    TABLES,
    TRAINED,
    Cell,
    Size,
    SizeName,
    cells,
    narrowed,
)

TINY = Size(("living_room_walk",), 2, "1:2", 3, 8, 2, 6, 0)


def result(seed: int, f10: float, **others: float) -> dict[str, Any]:
    """A cell of RF-GS on Wi-Fi, with baselines that have the F10 given for them."""

    def groups(value: float) -> dict[str, Any]:
        geometry = {"f05": value / 2, "f10": value, "f20": 1.0, "centroid_m": None}
        return {"geometry": geometry, "rf": {"element_snr_db": 3.0, "subcarrier_snr_db": None}}

    methods = {"rfgs": groups(f10), **{name: groups(value) for name, value in others.items()}}
    cell = {"scene": "living_room_walk", "radio": "wifi", "method": "rfgs", "seed": seed}
    return {**cell, "train_s": 10.0 * (seed + 1), "methods": methods}


def test_every_cell_once_and_one_seed_of_everything_first() -> None:
    chosen = cells(TABLES["table1"], SIZES["smoke"], 2)
    assert len(chosen) == len({cell.name for cell in chosen}) == 2 * 2 * (len(TRAINED) + 12 + 2)
    assert [cell.seed for cell in chosen] == sorted(cell.seed for cell in chosen)
    assert len({cell.dataset for cell in chosen}) == 2
    assert len(FIELDS) == 3 * 2 * 2 and len(CHANNEL_FIELDS) == 2
    # Nobody is heard behind a wall before depth 3.
    behind = Cell("through_wall", "wifi", "rfgs", 0).generate(Path("x"), SIZES["paper-cpu"])
    assert behind[behind.index("--depth") + 1] == "3"


def test_rows_are_means_over_seeds_beside_the_claim() -> None:
    rows = method_rows([result(0, 0.8, clean=0.4), result(1, 0.9, clean=0.4)])
    ours, clean = rows
    assert ours.mean["f10"] == pytest.approx(0.85) and ours.seeds == 2
    assert ours.deviation["f10"] == pytest.approx(0.0707, abs=1e-4)
    assert ours.mean["train_s"] == 15.0 and ours.claimed_psnr_db == 33.7
    # Nobody trains a classical baseline, and what has no value has none in the table.
    assert clean.mean["train_s"] is None and clean.claimed_psnr_db is None
    assert ours.mean["centroid_m"] is None
    text = method_table(rows)
    assert "| RF-GS | 0.425 ± 0.035 | 0.850 ± 0.071 |" in text and "| CLEAN |" in text
    assert "F10 CLEAN 0.400 (RF-GS 0.850)" in text


def test_the_strongest_of_others_is_named_even_where_it_wins() -> None:
    # Its own Gaussians without their residual are no baseline.
    rows = method_rows([result(0, 0.8, clean=0.4, omp=0.9, gaussians_alone=0.95)])
    (line, _) = strongest(rows)
    assert "F10 OMP 0.900 (RF-GS 0.800)" in line and "centroid" not in line
    assert strongest([row for row in rows if row.method != "rfgs"]) == []


def test_a_table_warns_where_hidden_entries_are_hardly_hidden() -> None:
    rows = method_rows([result(0, 0.8, nearest_element=0.1)])
    assert leaks(rows)[0].startswith("Not decided: copying the nearest visible entry explains 3.0")
    assert leaks(rows)[0] in method_table(rows)
    assert leaks(method_rows([result(0, 0.8, linear=0.1)])) == []


def test_ablations_differ_by_what_they_leave_out() -> None:
    chosen = cells(TABLES["table2"], SIZES["smoke"], 1)
    assert [chosen.pop(0).method for _ in range(2)] == ["rfgs", "paper"]
    assert len(chosen) == len(VARIANTS) == 7
    train = [settings_of(cell, SIZES["smoke"])["train"] for cell in chosen]
    # The whole recipe is the row of table 1, so that its cell is shared.
    assert chosen[0].method == "paper_prior" and train[0]["without"] == []
    for other in train[1:]:
        changed = {key for key, value in other.items() if value != train[0][key]}
        assert changed in ({"without"}, {"density"})
    assert len({str(one) for one in train}) == 7
    # Where it was made is no setting of a cell.
    assert all("device" not in one for one in train)


def test_the_papers_recipe_has_both_starts_in_both_tables() -> None:
    for table in ("table1", "table2"):
        starts = {}
        for cell in cells(TABLES[table], SIZES["paper-cpu"], 1):
            train = settings_of(cell, SIZES["paper-cpu"])["train"]
            starts[cell.method] = (train["start"], train["num_gaussians"], train["objective"])
        assert starts["paper"] == ("random", 100_000, "paper")
        assert starts["paper_prior"] == ("prior", 6000, "paper")
        assert starts["rfgs"] == ("prior", 6000, "csi")
    assert {start for start, *_ in starts.values()} == {"prior", "random"}


@pytest.mark.parametrize("size", ["smoke", "paper-cpu", "full"])
def test_fields_have_the_points_that_their_settings_were_searched_with(size: SizeName) -> None:
    def points(method: str) -> tuple[int, int]:
        cell = Cell("living_room_walk", "wifi", method, 0)
        train = settings_of(cell, SIZES[size])["train"]
        return train["grid_side"], train["refine_levels"]

    assert {points(method) for method in FIELDS} == {(32, 2)}
    assert points("paper") == (SIZES[size].grid_side, SIZES[size].refine_levels)


def test_every_radio_is_traced_as_deep_as_it_can_be() -> None:
    chosen = cells(TABLES["table3"], SIZES["paper-cpu"], 1)
    assert {cell.radio for cell in chosen} == {"wifi", "mmwave", "uwb", "sar"}
    # Behind a wall nobody is heard directly, and these two are traced no deeper.
    behind = {cell.radio for cell in chosen if cell.scene == "through_wall"}
    assert behind == {"wifi", "mmwave"}
    sar = Cell("living_room_walk", "sar", "rfgs", 0).generate(Path("x"), SIZES["smoke"])
    assert sar[sar.index("--depth") + 1] == "1" and sar[sar.index("--tracer") + 1] == "sionna"


@pytest.fixture
def everybody_stands(
    monkeypatch: pytest.MonkeyPatch, one_step: Callable[[pytest.MonkeyPatch], None]
) -> None:
    """Nobody is asked whether they sit, which takes longer than all the rest of a small cell."""
    one_step(monkeypatch)
    whole = study.cells.train_config
    monkeypatch.setattr(
        study.cells,
        "train_config",
        lambda cell, size: replace(
            whole(cell, size), posture="standing", num_gaussians=200, limbs="off"
        ),
    )


@pytest.mark.usefixtures("everybody_stands")
@pytest.mark.parametrize(
    "method", ["paper", "paper_prior", "paper_fixed", "nerf_features", "ngp_propagation_prior"]
)
def test_a_cell_is_kept_until_its_settings_change(
    method: str, tiny_dataset: Path, tmp_path: Path
) -> None:
    cell = Cell("living_room_walk", "wifi", method, 0)
    shutil.copytree(tiny_dataset, tmp_path / cell.dataset)
    assert stored(cell, tmp_path, TINY) is None
    made = make(cell, tmp_path, TINY)
    assert made["methods"][method]["geometry"]["f20"] is not None
    kept = stored(cell, tmp_path, TINY)
    assert kept is not None and method_rows([kept]) == method_rows([made])
    other = Size(("living_room_walk",), 2, "1:2", 4, 8, 3, 6, 0)
    assert stored(cell, tmp_path, other) is None
    again = read_json(tmp_path / "cells" / f"{cell.name}.json")
    assert again["settings"]["train"]["seed"] == 0 and again["dataset"]
    if method.startswith("paper"):
        assert again["gaussians"] > 0 and again["render_fps"] > 0.0
        # A run that is there already gives the same row, whenever it was cut off.
        (tmp_path / "cells" / f"{cell.name}.json").unlink()
        assert make(cell, tmp_path, TINY)["methods"] == made["methods"]


@pytest.mark.parametrize(
    ("method", "settings"),
    [
        ("ngrf", SumSettings(rounds=1, per_round=1, places=20, tried=2, steps=1)),
        ("wrfgs", SplatSettings(gaussians=4, width=4, steps=1)),
    ],
)
def test_fields_of_channels_are_cells_without_runs(
    method: str,
    settings: SumSettings | SplatSettings,
    tiny_dataset: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(CHANNEL_FIELDS, method, settings)
    cell = Cell("living_room_walk", "wifi", method, 0)
    shutil.copytree(tiny_dataset, tmp_path / cell.dataset)
    made = make(cell, tmp_path, TINY)
    whole, alone = made["methods"][method], made["methods"][f"{method}, alone"]
    # In whole it carries on what it leaves, so that the two differ.
    assert whole["rf"]["element_snr_db"] != alone["rf"]["element_snr_db"]
    assert (whole["geometry"]["f20"] is None) == (method == "wrfgs")
    assert alone["geometry"]["f20"] is None and made["train_s"] > 0.0
    kept = stored(cell, tmp_path, TINY)
    assert kept is not None and method_rows([kept]) == method_rows([made])
    assert {path.name for path in tmp_path.iterdir()} == {"cells", "data"}
    row, second = method_table(method_rows([made])).splitlines()[4:6]
    assert "nGRF" in row or "WRF-GS" in row
    assert "without residual" in second
    monkeypatch.setitem(CHANNEL_FIELDS, method, replace(settings, steps=2))
    assert stored(cell, tmp_path, TINY) is None


def test_a_table_may_be_narrowed_to_what_it_has() -> None:
    table, size = narrowed("table1", SIZES["smoke"], ["two_crossing"], ["wifi"], ["rfgs", "paper"])
    assert [cell.name for cell in cells(table, size, 1)] == [
        "two_crossing-wifi-rfgs-seed0",
        "two_crossing-wifi-paper-seed0",
    ]
    assert narrowed("table2", SIZES["smoke"]) == (TABLES["table2"], SIZES["smoke"])
    twice = [["two_crossing"] * 2, ["wifi"] * 2, ["rfgs", "paper", "rfgs"]]
    assert narrowed("table1", SIZES["smoke"], *twice) == (table, size)
    with pytest.raises(RfgsError, match=r"--radios uwb: expected some of wifi, mmwave in table1"):
        narrowed("table1", SIZES["smoke"], radios=["uwb"])
    with pytest.raises(RfgsError, match="--scenes kitchen: expected some of living_room_walk"):
        narrowed("table1", SIZES["smoke"], scenes=["kitchen"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--seeds 0", "--seeds 0: expected at least 1"),
        ("--methods 3dgs", "--methods 3dgs: expected some of rfgs, rfgs_no_limbs"),
        ("--workers 0", "--workers 0: expected 1 to 256"),
        ("--frames 10-40", "10-40"),
        ("--device cuda", "cuda"),
    ],
)
def test_options_of_a_table_are_refused_before_it_begins(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if words == "--device cuda" and torch.cuda.is_available():
        pytest.skip("there is a GPU")
    assert main(["bench", "table1", "--out", str(tmp_path / "out"), *words.split()]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
