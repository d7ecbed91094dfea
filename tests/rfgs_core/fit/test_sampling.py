# SPDX-License-Identifier: Apache-2.0
"""Where the paper's losses sample: grid, lines between devices, finer around a scatterer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset import open_dataset
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.fit.sampling import (
    encode,
    finer_points,
    line_points,
    sample_points,
    voxel_points,
)
from rfgs_core.measure.observations import Observations, observe
from rfgs_core.radio.constants import SPEED_OF_LIGHT

SCATTERER_M = np.array([2.3, 1.4, 1.1])


@pytest.fixture
def scattered(make_observations) -> Observations:
    """One point scatterer seen by four devices with enough bandwidth to resolve 7.5 cm."""
    empty = make_observations(freq_min_hz=4.8e9, freq_max_hz=6.8e9, num_subcarriers=64)
    out = np.linalg.norm(empty.layout.tx_xyz - SCATTERER_M, axis=1)
    back = np.linalg.norm(empty.layout.rx_xyz - SCATTERER_M, axis=1)
    path_m = out[:, None, None] + back[:, None]
    return empty.with_delta(np.exp(-2j * np.pi * empty.freq_hz * path_m / SPEED_OF_LIGHT))


def test_voxels_fill_the_bounds() -> None:
    bounds_m = np.array([[-1.0, 0.0, 2.0], [1.0, 4.0, 3.0]])
    points = voxel_points(bounds_m, 4)
    assert points.shape == (64, 3)
    np.testing.assert_allclose(points[0], [-0.75, 0.5, 2.125])
    np.testing.assert_allclose(points[-1], [0.75, 3.5, 2.875])
    np.testing.assert_allclose(points.mean(axis=0), bounds_m.mean(axis=0))


def test_line_points_lie_between_devices(make_observations) -> None:
    observations = make_observations()
    points = line_points(observations, np.random.default_rng(0))
    # 12 ordered pairs of different devices with 64 points each.
    assert points.shape == (768, 3)
    start = observations.layout.tx_xyz[0]
    end = observations.layout.rx_xyz[observations.layout.rx_device == 1].mean(axis=0)
    along = end - start
    share = (points[:64] - start) @ along / (along @ along)
    np.testing.assert_allclose(points[:64], start + share[:, None] * along, atol=1e-12)
    assert (np.floor(share * 64) == np.arange(64)).all()


def test_a_radar_has_no_lines(make_observations) -> None:
    from rfgs_core.radio import preset

    observations = make_observations(radio=preset("mmwave"))
    assert line_points(observations, np.random.default_rng(0)).shape == (0, 3)


def test_sample_points_carry_features(tiny_dataset: Path) -> None:
    observations = observe(open_dataset(tiny_dataset).sequence(), "wifi", 1)
    points = sample_points(observations, 5, np.random.default_rng(0), MATCHED_FILTER)
    assert len(points.xyz) == 125 + 64 * 10
    norm = (points.features.double() ** 2).sum(dim=1).mean().item()
    assert norm == pytest.approx(1.0, rel=1e-5)
    again = encode(observations, points.xyz.double().numpy(), MATCHED_FILTER)
    np.testing.assert_allclose(again.features, points.features, rtol=0.02, atol=1e-4)


def test_cells_split_into_eight() -> None:
    """Children of the strongest cell tile it; silent cells stay whole."""
    centres = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    cell_m = np.array([0.4, 0.8, 1.2])
    children = finer_points(centres, np.array([1.0, 5.0, 0.0]), 1, cell_m)
    assert children.shape == (8, 3)
    np.testing.assert_allclose(children.mean(axis=0), 1.0)
    np.testing.assert_allclose(np.abs(children - 1.0), np.tile(cell_m / 4, (8, 1)))
    assert len(np.unique(children, axis=0)) == 8
    assert len(finer_points(centres, np.array([1.0, 5.0, 0.0]), 3, cell_m)) == 16


def test_refinement_gathers_at_a_scatterer(scattered) -> None:
    side = 16
    coarse = sample_points(scattered, side, np.random.default_rng(0), MATCHED_FILTER)
    fine = sample_points(scattered, side, np.random.default_rng(0), MATCHED_FILTER, levels=2)
    # Grid and lines come first, unchanged; each level adds an eighth of the grid.
    assert (fine.xyz[: len(coarse.xyz)] == coarse.xyz).all()
    added = fine.xyz[len(coarse.xyz) :].numpy()
    assert len(added) == 2 * side**3 // 8
    away = np.linalg.norm(added - SCATTERER_M, axis=1)
    everywhere = np.linalg.norm(coarse.xyz[: side**3].numpy() - SCATTERER_M, axis=1)
    first, second = np.split(away, 2)
    assert np.median(second) < np.median(first) < 0.5 * np.median(everywhere)
    # The best of all points is next to the scatterer, nearer than the grid's best can be.
    energy = (fine.features**2).sum(dim=1).numpy()
    best = fine.xyz[int(energy.argmax())].numpy()
    cell_m = np.array([4.0, 3.5, 2.5]) / side
    assert (np.abs(best - SCATTERER_M) < 0.3 * cell_m).all()
    assert np.mean(np.sum(fine.features.numpy() ** 2, axis=1)) == pytest.approx(1.0, rel=1e-4)


def test_sampling_repeats_itself(scattered) -> None:
    first, again, other = (
        sample_points(scattered, 8, np.random.default_rng(seed), MATCHED_FILTER, levels=2)
        for seed in (0, 0, 1)
    )
    assert (first.xyz == again.xyz).all()
    assert (first.features == again.features).all()
    # Another seed moves the points on the lines and nothing else.
    moved = (first.xyz != other.xyz).any(dim=1).numpy()
    assert moved[8**3 : 8**3 + 768].all()
    assert not np.delete(moved, np.arange(8**3, 8**3 + 768)).any()


def test_silence_is_not_refined(make_observations) -> None:
    points = sample_points(
        make_observations(), 8, np.random.default_rng(0), MATCHED_FILTER, levels=2
    )
    assert len(points.xyz) == 8**3 + 768
    assert (points.features == 0).all()
