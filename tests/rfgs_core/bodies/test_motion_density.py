# SPDX-License-Identifier: Apache-2.0
"""Gaussians follow the pace of their bodies: how many, which ones, and exact resumption."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rfgs_core.bodies.motion_density import (
    LEAST,
    MOST,
    WALK_M_S,
    kept,
    novelty,
    speeds_m_s,
    wanted_counts,
)
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.figures.motion import write_motion_chart
from rfgs_core.run import Run
from rfgs_core.run.motion import read_motion, speeds_between
from tests import tiny_dataset as tiny

FRAMES = list(range(1, 9))


def walks_then_stands(frame: int) -> np.ndarray:
    """Centre of the sphere: 1.5 m/s for half a second, then it stands."""
    return np.array([0.9 + 0.15 * min(frame - 1, 4), 1.4, 1.0])


@pytest.fixture(scope="module")
def stopping(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny dataset over eight frames; who walks stops after the fifth."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiny, "FRAMES", FRAMES)
        patch.setattr(tiny, "centre_m", walks_then_stands)
        return tiny.write_tiny_dataset(tmp_path_factory.mktemp("stopping") / "dataset")


@pytest.fixture(scope="module")
def run(stopping: Path, tmp_path_factory, train, quick_config) -> Run:
    """Trained with as many Gaussians as suit the pace."""
    out = tmp_path_factory.mktemp("motion") / "run"
    return train(stopping, out, replace(quick_config, density="motion"), FRAMES)


def test_the_count_rises_with_the_pace_between_its_bounds() -> None:
    paces = np.linspace(0, 5, 101)
    counts = np.array([wanted_counts(1000, np.array([pace]))[0] for pace in paces])
    assert (np.diff(counts) >= 0).all()
    assert counts[0] == 1000 * LEAST
    assert counts[-1] == 1000 * MOST
    assert wanted_counts(1000, np.array([WALK_M_S])).tolist() == [1000]
    # Each body by its own pace, and none without any.
    assert wanted_counts(1000, np.array([0.0, WALK_M_S])).tolist() == [125, 500]
    assert wanted_counts(1, np.array([0.0, 0.0])).tolist() == [1, 1]


def test_the_change_of_a_still_body_is_not_new(make_observations) -> None:
    frame = make_observations()
    rng = np.random.default_rng(0)
    size = (2, *frame.delta.shape)
    noise = (rng.standard_normal(size) + 1j * rng.standard_normal(size)).astype(np.complex64)
    first, second = (frame.with_delta(part) for part in noise)
    assert novelty(first, first) == 0.0
    assert novelty(frame, frame) == 0.0
    assert novelty(first, second) == pytest.approx(1.0, abs=0.05)
    # Turned by φ: |1 − e^{jφ}|² / 2 = 1 − cos φ, and not more than all of it.
    for phase in (0.1, 1.0, 2.5):
        turned = first.with_delta(noise[0] * np.exp(1j * phase))
        assert novelty(turned, first) == pytest.approx(min(1 - np.cos(phase), 1.0), rel=1e-4)
    lost = replace(second, links=second.links & (np.arange(size[2]) % 2 == 0))
    assert 0 < novelty(first, lost) <= 1.0


def test_a_trembling_track_of_a_still_change_has_no_pace() -> None:
    tracks = Tracks(
        *(np.zeros((2, 2)), np.array([[0.3, 0.4], [np.nan, np.nan]]), 1.0), np.full(2, np.nan)
    )
    assert speeds_m_s(tracks, 0.0).tolist() == [0.0, WALK_M_S]
    assert speeds_m_s(tracks, 0.5).tolist() == [0.25, WALK_M_S]


def test_those_that_reflect_least_go_first() -> None:
    body = np.array([0, 1, 0, 0, 1])
    power = np.array([3.0, 1.0, 0.0, 5.0, 2.0])
    assert kept(body, power, np.array([2, 1])).tolist() == [True, False, False, True, True]
    assert kept(body, power, np.array([9, 0])).tolist() == [True, False, True, True, False]


def test_who_stops_has_fewer_gaussians_than_when_walking(run: Run, quick_config) -> None:
    motion = read_motion(run.path, FRAMES)
    assert motion is not None
    assert motion.count[0] == quick_config.num_gaussians
    walking, standing = motion.count[1:5], motion.count[-2:]
    assert standing.tolist() == [quick_config.num_gaussians * LEAST] * 2
    assert walking.mean() > 2 * standing.mean()
    for frame, count in zip(FRAMES, motion.count, strict=True):
        attributes = run.attributes(frame)
        assert len(run.moving(frame)) == count == len(set(attributes["track_id"].tolist()))
    # Standing still, two thirds go on, as without this rule.
    before, after = (run.attributes(frame)["track_id"] for frame in FRAMES[-2:])
    assert len(set(after) & set(before)) == len(before) - len(before) // 3


def test_stopping_the_training_changes_nothing(
    run: Run, stopping: Path, train, quick_config
) -> None:
    # Beside the run, so that its dataset is where its settings say.
    folder = Path(shutil.copytree(run.path, run.path.parent / "again"))
    for frame in FRAMES[5:]:
        for file in folder.rglob(f"{frame:06d}.*"):
            file.unlink()
    again = train(stopping, folder, replace(quick_config, density="motion"), FRAMES)
    for frame in FRAMES:
        for name in (f"gaussians/{frame:06d}.ply", f"gaussians/{frame:06d}.features.npz"):
            assert (again.path / name).read_bytes() == (run.path / name).read_bytes()


def test_the_chart_shows_counts_and_speeds(run: Run, tmp_path: Path) -> None:
    picture = tmp_path / "motion.png"
    assert write_motion_chart(picture, run.path, run.sequence, FRAMES)
    with Image.open(picture) as image:
        assert np.asarray(image.convert("L")).std() > 5
    first = picture.read_bytes()
    assert write_motion_chart(picture, run.path, run.sequence, FRAMES)
    assert picture.read_bytes() == first
    assert not write_motion_chart(tmp_path / "none.png", run.path, run.sequence, FRAMES[:2])
    assert not write_motion_chart(tmp_path / "none.png", tmp_path, run.sequence, FRAMES)
    assert not (tmp_path / "none.png").exists()


def test_speeds_are_ways_over_time() -> None:
    xy = np.array([[[0.0, 0.0]], [[0.3, 0.4]], [[0.3, 0.4]]])
    speed = speeds_between(xy, np.array([0.0, 0.25, 1.0]))[:, 0]
    assert np.isnan(speed[0])
    assert speed[1:] == pytest.approx([2.0, 0.0])
