# SPDX-License-Identifier: Apache-2.0
"""Runs that start as the paper starts know of no bodies, and everything else works on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rfgs_core.cli import main
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.metrics import evaluate_method
from rfgs_core.fit.sampling import SamplePoints, sample_points
from rfgs_core.gaussians.ply import read_ply
from rfgs_core.measure.observations import Observations
from rfgs_core.pose import estimate_poses
from rfgs_core.run import Run, open_run
from rfgs_core.run.config import RunConfig
from rfgs_core.run.people import HeadCount
from rfgs_core.seals import read_sealed_json, write_sealed_json
from rfgs_core.settings import TrainConfig, TrainOptions


@pytest.fixture(scope="module")
def random_run(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """The command with the paper's recipe and nothing else but sizes; a coarse grid of points."""
    out = tmp_path_factory.mktemp("random") / "run"
    words = f"train {tiny_dataset} --radio wifi --recipe paper --gaussians 300 --iterations 3"
    with pytest.MonkeyPatch.context() as patch:
        asked = []

        def coarse(observations: Observations, side: int, *more: Any) -> SamplePoints:
            asked.append(side)
            return sample_points(observations, 24, *more)

        patch.setattr("rfgs_core.fit.task.sample_points", coarse)
        assert main([*words.split(), "--no-shader", "--out", str(out)]) == 0
        assert set(asked) == {64}
        yield open_run(out)


def test_one_flag_is_the_papers_recipe(random_run: Run) -> None:
    settings = random_run.config.settings
    assert (settings.objective, settings.start, settings.refine_levels) == ("paper", "random", 0)
    whole = TrainConfig.chosen(TrainOptions(recipe="paper"))
    assert (whole.num_gaussians, whole.iterations) == (100_000, 10_000)
    assert (whole.grid_side, whole.batch_points) == (64, 1024)
    ours = TrainConfig.chosen(TrainOptions(recipe="paper", start="prior"))
    assert ours == replace(whole, start="prior", num_gaussians=TrainConfig().num_gaussians)
    # With another objective there is nothing that draws Gaussians to where echoes come from.
    assert TrainConfig.chosen(TrainOptions(recipe="paper", objective="csi")).start == "prior"
    assert TrainConfig.chosen(TrainOptions()) == TrainConfig()


def test_a_configuration_is_read_as_it_was_written(random_run: Run, tmp_path: Path) -> None:
    random_run.config.write(tmp_path)
    assert RunConfig.read(tmp_path) == random_run.config
    # Runs of before started from the prior, and do not say so.
    stored = read_sealed_json(tmp_path / "config.json", "again")
    del stored["start"]
    write_sealed_json(tmp_path / "config.json", {**stored, "recipe": "rfgs", "objective": "csi"})
    assert RunConfig.read(tmp_path).settings.start == "prior"


def test_nobody_is_known_and_every_frame_is_drawn_anew(random_run: Run) -> None:
    assert HeadCount.read(random_run.path) is None
    numbers = []
    for frame in random_run.frames:
        assert random_run.bodies(frame) is None
        attributes = random_run.attributes(frame)
        assert (attributes["body"] == -1).all()
        numbers.append(attributes["track_id"])
        assert np.isfinite(random_run.predict(frame)).all()
        assert np.abs(random_run.predict(frame)).max() > 0.0
    assert not np.isin(*numbers).any()
    assert len(read_ply(random_run.ply_path(1))) == len(numbers[0])


@pytest.mark.slow
def test_it_is_evaluated_reported_and_exported(random_run: Run, tmp_path: Path) -> None:
    groups = evaluate_method(random_run)
    assert groups["method"]["geometry"]["f20"] is not None
    run = str(random_run.path)
    assert main(["eval", run]) == 0
    assert main(["report", run]) == 0
    assert main(["export", run, "--out", str(tmp_path / "cloud.ply")]) == 0
    assert len(read_ply(tmp_path / "cloud.ply")) > 0
    again = ["--no-shader", "--out", run]
    place = str((random_run.path / random_run.config.dataset).resolve())
    words = ["--radio", "wifi", "--recipe", "paper", "--gaussians", "300", "--iterations", "3"]
    assert main(["train", place, *words, *again]) == 0


def test_poses_of_nobody_are_refused(random_run: Run) -> None:
    with pytest.raises(RfgsError, match="--start random knows of no people; train with --start"):
        estimate_poses(random_run)
