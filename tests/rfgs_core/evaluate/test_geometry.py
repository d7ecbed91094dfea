# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import inspect

import numpy as np
import pytest
from scipy.spatial import KDTree

from rfgs_core.errors import RfgsError
from rfgs_core.evaluate import geometry
from rfgs_core.evaluate.geometry import (
    best_voxels,
    f_score_curve,
    geometry_metrics,
    reference_points,
    voxel_budget,
)
from rfgs_core.evaluate.grid import Grid

GRID = Grid.over(np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]]))
#: A horizontal square of 1 m² through voxel centres.
SQUARE = np.array([[0.5, 0.5, 1.02], [1.5, 0.5, 1.02], [1.5, 1.5, 1.02], [0.5, 1.5, 1.02]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def plane_score(layer: int) -> np.ndarray:
    """The voxels of one layer that cover the square."""
    score = np.zeros(GRID.shape, np.float32)
    x = GRID.axis_m(0)
    inside = (x > 0.5) & (x < 1.5)
    score[np.ix_(inside, inside, [layer])] = 1.0
    return score


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return reference_points(SQUARE, FACES, n=20000, seed=0)


def test_a_perfect_prediction_scores_one(reference: np.ndarray) -> None:
    result = geometry_metrics(plane_score(25), GRID, reference, 625)
    assert result["f05"] == pytest.approx(1.0, abs=1e-3)
    assert result["f10_best"] == pytest.approx(1.0, abs=1e-3)
    assert result["centroid_m"] == pytest.approx(0.0, abs=0.01)
    assert result["tracked"] == 1.0
    assert result["height_m"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("layers", "expected"),
    [(1, (1, 1, 1)), (2, (0, 1, 1)), (4, (0, 0, 1)), (6, (0, 0, 0))],
)
def test_a_shifted_plane_scores_by_its_distance_alone(
    reference: np.ndarray, layers: int, expected: tuple[int, int, int]
) -> None:
    # Four centimetres per layer: 4, 8, 16 and 24 cm against thresholds of 5, 10 and 20 cm.
    result = geometry_metrics(plane_score(25 + layers), GRID, reference, 625)
    for key, value in zip(("f05", "f10", "f20"), expected, strict=True):
        # At 4 cm the rim, cut to whole voxels, loses 2.5 cm of the 5 cm left sideways.
        assert result[key] == pytest.approx(value, abs=0.03)
    assert result["centroid_m"] == pytest.approx(0.04 * layers, abs=0.01)
    assert result["chamfer_m"] == pytest.approx(0.04 * layers, abs=0.01)


def test_half_the_plane_has_precision_one_and_recall_one_half(reference: np.ndarray) -> None:
    score = plane_score(25)
    score[25:] = 0.0
    result = geometry_metrics(score, GRID, reference, 625)
    # Recall reaches the threshold beyond the edge: 0.5 m + 4.6 cm of 1 m.
    assert result["f05"] == pytest.approx(2 * 0.546 / 1.546, abs=0.02)


def test_a_blind_score_everywhere_is_no_prediction_of_the_plane(reference: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    score = rng.random(GRID.shape).astype(np.float32)
    result = geometry_metrics(score, GRID, reference, 625)
    # 1 m² in 8 m³: P = 0.03 with the rim; R = 0.28, each point has 65 voxels within 10 cm.
    assert result["f10"] is not None
    assert result["f10"] == pytest.approx(2 * 0.032 * 0.28 / 0.312, abs=0.02)


def test_an_empty_score_predicts_nothing_and_scores_zero(reference: np.ndarray) -> None:
    result = geometry_metrics(np.zeros(GRID.shape, np.float32), GRID, reference, 625)
    assert result["f10"] == 0.0
    assert result["tracked"] == 0.0
    assert result["chamfer_m"] is None


def test_f_scores_agree_with_plain_nearest_neighbour_searches(reference: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    score = plane_score(26) * rng.random(GRID.shape).astype(np.float32)
    k = 300
    result = geometry_metrics(score, GRID, reference, k)
    predicted = GRID.centres(best_voxels(score, k))
    precision = np.mean(KDTree(reference).query(predicted)[0] <= 0.05)
    recall = np.mean(KDTree(predicted).query(reference)[0] <= 0.05)
    assert result["f05"] == pytest.approx(2 * precision * recall / (precision + recall), abs=1e-9)


def test_the_curve_over_k_agrees_with_single_budgets(reference: np.ndarray) -> None:
    rng = np.random.default_rng(2)
    score = plane_score(26) * rng.random(GRID.shape).astype(np.float32)
    ranked = best_voxels(score, 400)
    distance_m = KDTree(reference).query(GRID.centres(ranked))[0]
    curve = f_score_curve(ranked, distance_m, GRID, reference, 0.1)
    for k in (1, 37, 400):
        assert curve[k - 1] == pytest.approx(geometry_metrics(score, GRID, reference, k)["f10"])


def test_best_k_is_never_worse_than_the_nominal_one(reference: np.ndarray) -> None:
    result = geometry_metrics(plane_score(25), GRID, reference, 100)
    assert result["f10"] is not None and result["f10_best"] is not None
    assert result["f10_best"] > result["f10"]


def test_budget_follows_from_the_nominal_surface_and_not_from_the_frame() -> None:
    person = {"id": 1, "nominal_surface_m2": 1.6}
    assert voxel_budget([person]) == 1500
    assert voxel_budget([person, {**person, "id": 2}]) == 3000
    assert "vertices" not in inspect.signature(voxel_budget).parameters
    assert list(inspect.signature(geometry_metrics).parameters)[-1] == "k"


def test_budget_without_anything_that_moves_is_refused() -> None:
    with pytest.raises(RfgsError, match="nominal_surface_m2"):
        voxel_budget([{"id": 1, "nominal_surface_m2": None}])


def test_reference_points_are_spread_by_area() -> None:
    vertices = np.array([[0, 0, 0], [3, 0, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5.0]])
    points = reference_points(vertices, np.array([[0, 1, 2], [3, 4, 5]]), n=4000, seed=3)
    assert np.mean(points[:, 2] == 0) == pytest.approx(0.75, abs=0.03)
    lower = points[points[:, 2] == 0]
    np.testing.assert_allclose(lower.mean(axis=0), [1.0, 1 / 3, 0.0], atol=0.05)
    assert (lower[:, 0] / 3 + lower[:, 1] <= 1 + 1e-9).all()


def test_reference_points_of_a_mesh_without_area_are_refused() -> None:
    with pytest.raises(RfgsError, match="area"):
        reference_points(np.zeros((3, 3)), np.array([[0, 1, 2]]))


def test_ties_are_broken_by_index() -> None:
    score = np.zeros((4, 1, 1), np.float32)
    score[1:] = 1.0
    np.testing.assert_array_equal(best_voxels(score, 2), [1, 2])


def test_a_score_of_another_grid_is_refused(reference: np.ndarray) -> None:
    with pytest.raises(ValueError, match="expected a score of shape"):
        geometry_metrics(np.zeros((2, 2, 2)), GRID, reference, geometry.BEST_K_FACTOR)
