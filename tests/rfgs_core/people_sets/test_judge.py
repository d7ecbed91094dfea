# SPDX-License-Identifier: Apache-2.0
"""Our network on miniatures of public sets: the places, its rows and controls, the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from miniatures import (
    PLACE_M,
    walker,
    write_hupr,
    write_m4human,
    write_mmbody,
    write_mmfi,
    write_rtpose,
)

from rfgs_core.cli import main
from rfgs_core.encode.matched_filter import matched_filter_map
from rfgs_core.errors import RfgsError
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.weights import own_network
from rfgs_core.people_sets.judge import _picture_error, found_place, judge_people
from rfgs_core.people_sets.scatterers import heard_by_us
from rfgs_core.radio import PRESETS


@pytest.fixture(scope="module")
def network() -> LimbNetwork:
    trained = own_network(PRESETS["mmwave"].freq_hz)
    assert trained is not None
    return trained.network


def test_a_body_is_found_among_clutter() -> None:
    rng = np.random.default_rng(1)
    for joints, points in walker(3):
        wall = np.stack([rng.uniform(-3, 3, 120), np.full(120, 5.0), rng.uniform(-1, 1.5, 120)], -1)
        place = found_place(np.concatenate([points, wall]))
        assert np.linalg.norm(place[:2] - joints[0, :2]) < 0.1
        assert np.linalg.norm(place[:2] - PLACE_M) < 0.1
    # One point far away does not make a search without end.
    far = np.concatenate([points, [[1e6, 1e6, 0.0]]])
    assert np.linalg.norm(found_place(far)[:2] - PLACE_M) < 0.1


def test_a_point_is_heard_where_it_is() -> None:
    point = np.array([[0.5, 2.0, 0.3]])
    seen = heard_by_us(point, np.ones(1), point[0].copy(), np.random.default_rng(0))
    pair, _ = seen.pairs
    tried = point + np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.2, 0], [0, 0, 0.4], [0, -0.2, 0]])
    power = matched_filter_map(seen.delta, seen.layout, pair, seen.freq_hz, tried)[0]
    assert power[0] > 5.0 * power[1:].max()


@pytest.mark.parametrize("write", [write_mmfi, write_mmbody, write_m4human])
def test_rows_and_controls_on_point_clouds(tmp_path: Path, network, write) -> None:
    write(tmp_path, frames=4)
    table = judge_people(tmp_path, network)
    assert float(table["place found: median error [m]"]) < 0.12
    error = {
        row: float(table[f"{row}: joints, pelvis aligned [m]"])
        for row in ("network, place found", "network, place told", "network, another frame")
    }
    # Dense points of a whole side, as no radar gives them.
    assert error["network, place told"] < 0.2
    found, told, other = error.values()
    assert 0.02 < min(found, told, other)
    # Whoever's points and wherever: nearer than the mean walk by more than frames differ.
    walk = float(table["mean walk, place told: joints, pelvis aligned [m]"])
    assert max(found, told, other) < walk - 0.03
    if write is write_m4human:
        # The moment's own points tell its pose, best at the true place: docs/captures.md.
        assert told < found < other and other - told > 0.03
    else:
        # One radar's points say no more of the pose of the moment than another frame's do.
        assert abs(found - other) < 0.03
    assert float(table["mean walk, place told: joints [m]"]) < 0.5
    # The walker may face either way; told the wrong side, the mean walk is no better than that.
    assert "network, place found: the same, sides swapped [m]" in table


def test_rows_on_cells_and_what_is_assumed(tmp_path: Path, network) -> None:
    write_rtpose(tmp_path, frames=2)
    table = judge_people(tmp_path, network)
    assert (table["set"], table["frames"]) == ("RT-Pose", 2)
    # Cells are 16 cm wide and 36 cm high.
    assert float(table["place found: median error [m]"]) < 0.15
    assert float(table["network, place told: joints, pelvis aligned [m]"]) < 0.25
    assert table["assumed 1"] == "y points left (right-handed axes)"


def test_pictures_are_compared_up_to_scale_and_shift(tmp_path: Path, network) -> None:
    said = np.random.default_rng(3).standard_normal((17, 2))
    truth = 40.0 * said + [128.0, 100.0]
    truth[4] = np.nan
    assert _picture_error(said, truth) == pytest.approx(0.0, abs=1e-12)
    height = np.ptp(truth[np.isfinite(truth[:, 1]), 1])
    moved = truth.copy()
    moved[0, 0] += 1e-6 * height
    assert 0.0 < _picture_error(said, moved) < 1e-6
    write_hupr(tmp_path)
    with pytest.raises(RfgsError, match="no frame holds 5 points or more"):
        judge_people(tmp_path, network)


def test_the_command_prints_claims_as_claims(tmp_path: Path, capsys) -> None:
    write_hupr(tmp_path / "set")
    rng = np.random.default_rng(0)
    for file in sorted((tmp_path / "set").rglob("*.npy")):
        cube = np.load(file)
        np.save(file, cube + 0.1 * rng.random(cube.shape))
    report = tmp_path / "people.json"
    assert main(["bench", "people", "--data", str(tmp_path / "set"), "--json", str(report)]) == 0
    out = capsys.readouterr().out
    assert "network, place found: joints in the picture [heights]" in out
    assert "claimed, not reproduced" in out
    assert json.loads(report.read_text())["set"] == "HuPR"
    assert main(["bench", "people", "--data", str(tmp_path)]) == 2
    assert "expected MM-Fi" in capsys.readouterr().err
    assert main(["bench", "people", "--data", "a", "--dataset", "b"]) == 2
    assert "--data FOLDER of a public set, not both" in capsys.readouterr().err
    assert main(["bench", "people"]) == 2
    assert "--data FOLDER of a public set, see docs" in capsys.readouterr().err
