# SPDX-License-Identifier: Apache-2.0
"""An excess path is found where there is one, taken off before the fit and put on again."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr
from lit_bodies import lit

from rfgs_core.bodies.count import place_bodies
from rfgs_core.bodies.excess_path import excess_path_m
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.files import write_json
from rfgs_core.measure.observations import Observations, excess_turn
from rfgs_core.radio import preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.run import Run, open_run
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig

ROOM_M = np.array([[0.0, 0.0, 0.0], [5.0, 4.6, 2.4]])
BODIES = [(1.5, 2.9), (3.4, 1.6)]


@pytest.fixture
def empty(make_observations: Callable[..., Observations]) -> Observations:
    radio = replace(preset("wifi"), rx_rows=2, rx_cols=2, num_subcarriers=24)
    return make_observations(radio=radio, bounds_m=ROOM_M)


def test_a_longer_path_is_a_later_echo() -> None:
    freq_hz = 5.8e9 + 2.5e6 * np.arange(64)
    path_m = SPEED_OF_LIGHT / (64 * 2.5e6) * 3.0
    profile = np.abs(np.fft.ifft(excess_turn(freq_hz, path_m)))
    assert profile.argmax() == 3 and profile[3] == pytest.approx(1.0)


def test_taking_off_what_was_put_on_gives_the_same_frame(empty: Observations) -> None:
    seen = lit(empty, BODIES[:1], seed=2)
    there = seen.lengthened(0.9)
    assert np.abs(there.delta - seen.delta).max() > 0.5 * np.abs(seen.delta).max()
    np.testing.assert_allclose(np.abs(there.delta), np.abs(seen.delta), rtol=1e-5)
    back = there.lengthened(-0.9).delta
    np.testing.assert_allclose(back, seen.delta, atol=1e-6 * np.abs(seen.delta).max())
    assert seen.lengthened(0.0) is seen


@pytest.mark.parametrize("path_m", [0.0, 1.0])
def test_an_excess_path_is_found_where_there_is_one(empty: Observations, path_m: float) -> None:
    lefts: list[int] = []
    seen = lit(empty, BODIES[:1], seed=2).lengthened(path_m)
    found = excess_path_m([seen], TrainConfig(), 0, lefts.append)
    if path_m:
        assert found == pytest.approx(path_m, abs=0.2)
    else:
        # A single look too many would cost every run without a wall its time.
        assert found == 0.0 and lefts == [1, 0]


def test_nobody_there_has_no_excess_path(empty: Observations) -> None:
    assert excess_path_m([empty], TrainConfig(), 0) == 0.0


def test_people_are_placed_where_they_stand_or_not_at_all(empty: Observations) -> None:
    seen = lit(empty, BODIES, seed=2)
    places = place_bodies(seen, 2, TrainConfig(), 0)
    assert places is not None
    for place in BODIES:
        assert np.linalg.norm(places - place, axis=1).min() < 0.2
    assert place_bodies(empty, 2, TrainConfig(), 0) is None


def behind_a_wall(dataset: Path, path_m: float) -> Path:
    """Makes what the moving ball of the tiny dataset changes come later, in the first frame."""
    sequence, files = open_dataset(dataset).sequence(), SequenceFiles(dataset / "tiny")
    static = sequence.csi_static("wifi")
    turn = excess_turn(sequence.radio_spec("wifi").freq_hz, path_m)
    stored = (static + (sequence.csi("wifi", 1) - static) * turn).astype(np.complex64)
    zarr.open_array(str(files.csi("wifi") / "csi"), mode="r+")[0] = stored
    write_json(files.csi_done("wifi", 1), {"sha256": digest(stored)})
    return dataset


def test_what_a_run_says_has_the_excess_path_that_its_fit_was_spared(
    tiny_dataset: Path, tmp_path: Path, quick_config: TrainConfig
) -> None:
    data = open_dataset(behind_a_wall(Path(shutil.copytree(tiny_dataset, tmp_path / "data")), 2.0))
    out = tmp_path / "run"
    run = train_sequence(data, data.sequence(), "wifi", [1], quick_config, out, excess=2.0)
    assert open_run(out).config.settings.excess_m == 2.0
    reported, seen = run.as_reported(1), run.observations(1)
    turn = excess_turn(seen.freq_hz, 2.0)
    np.testing.assert_allclose(seen.delta * turn, reported.delta, atol=1e-6)
    change = run.visible_change(1, seen)
    visible = seen.links[..., None] & seen.subcarriers
    np.testing.assert_allclose(change[visible], reported.delta[visible], atol=1e-6)
    # The prediction is held against the channel as it is, delay and all.
    entries, predicted = reported.delta[visible], run.predict(1)[visible]
    likeness = np.vdot(entries, predicted) / np.linalg.norm(entries) / np.linalg.norm(predicted)
    spared = np.vdot(seen.delta[visible], predicted) / np.linalg.norm(entries)
    assert likeness.real > 0.4
    assert abs(likeness) > 2.0 * abs(spared / np.linalg.norm(predicted))
    # The same command again knows; another number is another run.
    again = train_sequence(data, data.sequence(), "wifi", [1], quick_config, out, excess="auto")
    assert again.config == run.config


def test_without_phases_there_is_no_excess_path(small_run: Run, tmp_path: Path, capsys) -> None:
    data = str(small_run.sequence.path.parent)
    out = tmp_path / "run"
    command = ["train", data, "--radio", "wifi", "--out", str(out), "--observe", "power"]
    assert main([*command, "--excess-path", "0.5"]) == 2
    told = capsys.readouterr()
    assert "--excess-path 0.5: expected the phases" in told.out + told.err
    for wrong in ("-1", "nan", "21"):
        assert main([*command[:-2], "--excess-path", wrong]) == 2
        told = capsys.readouterr()
        assert f"--excess-path {wrong}: expected auto, or 0 to 20 m" in told.out + told.err
