# SPDX-License-Identifier: Apache-2.0
"""FISTA, non-negative powers and MUSIC beside closed forms and plain twins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.baselines.fista import PENALTY, few_points
from rfgs_core.evaluate.baselines.lattice import Lattice, lattice_of
from rfgs_core.evaluate.baselines.music import blocks_of, pseudo_spectrum, runs_of, window_of
from rfgs_core.evaluate.baselines.nonnegative import powers
from rfgs_core.evaluate.baselines.scatterers import PointModel
from rfgs_core.evaluate.geometry import best_voxels
from rfgs_core.evaluate.grid import Grid

ONE = np.array([[2.0, 1.7, 1.2]])
TWO = np.array([[1.4, 1.3, 1.0], [2.6, 2.2, 1.4]])
METHODS = ("fista", "nnls", "music")


@pytest.fixture
def lattice(scatterers) -> Lattice:
    found = lattice_of(scatterers(TWO, voxels=1500).evidence)
    assert found is not None
    return found


def test_many_phasors_are_those_of_single_points(scatterers) -> None:
    model = PointModel(scatterers(ONE).evidence)
    many = model.phasors(TWO, 2)
    for index, point in enumerate(TWO):
        np.testing.assert_allclose(many[..., index], model.steering(point, 2), atol=2e-4)


def test_the_lattice_holds_means_over_entries(lattice: Lattice) -> None:
    model, measured = lattice.model, lattice.model.measurements()
    first, last = lattice.points[0], lattice.points[-1]
    for pair in (0, len(model.pairs) - 1):
        a, b = model.steering(first, pair).ravel(), model.steering(last, pair).ravel()
        assert lattice.alike[pair, 0, -1] == pytest.approx(np.mean(a.conj() * b), abs=1e-4)
        assert lattice.alike[pair, -1, 0] == pytest.approx(np.mean(b.conj() * a), abs=1e-4)
        assert lattice.echo[pair, -1] == pytest.approx(
            np.mean(b.conj() * measured[pair].ravel()), abs=1e-4
        )


@pytest.mark.parametrize("name", METHODS)
def test_one_scatterer_is_found_where_it_is(scatterers, name: str) -> None:
    made = scatterers(ONE)
    score = BASELINES[name](made.evidence).score
    found = made.evidence.grid.centres(best_voxels(score, 20)).mean(axis=0)
    assert np.linalg.norm(found - ONE[0]) < 0.1


@pytest.mark.parametrize("name", METHODS)
def test_a_silent_pair_says_nothing_and_a_silent_frame_shows_nothing(scatterers, name: str) -> None:
    """What a wall keeps from a device pair must not decide where the points are."""
    evidence = scatterers(ONE).evidence
    model = PointModel(evidence)
    delta = evidence.delta.copy()
    tx, rx = model.links[0]
    delta[tx, rx] *= 0.0
    score = BASELINES[name](replace(evidence, delta=delta)).score
    found = evidence.grid.centres(best_voxels(score, 20)).mean(axis=0)
    assert np.linalg.norm(found - ONE[0]) < 0.1
    silent = BASELINES[name](replace(evidence, delta=evidence.delta * 0.0))
    assert silent.score is None and silent.reason == "the frame holds no energy"


def test_fista_meets_the_conditions_of_the_group_lasso(lattice: Lattice) -> None:
    """Where a point is, the gradient is the penalty along its amplitudes; elsewhere it is less."""
    amplitude = few_points(lattice)
    scale = np.sqrt(lattice.level)[:, None]
    echo = lattice.echo / scale
    penalty = PENALTY * np.linalg.norm(echo, axis=0).max()
    gradient = echo - np.einsum("pij,pj->pi", lattice.alike, amplitude / scale)
    size = np.linalg.norm(gradient, axis=0)
    used = np.any(amplitude != 0.0, axis=0)
    assert 2 <= used.sum() < len(used) / 4
    assert size[~used].max() < 1.05 * penalty
    strong = np.linalg.norm(amplitude, axis=0) > 0.1 * np.linalg.norm(amplitude, axis=0).max()
    np.testing.assert_allclose(size[strong], penalty, rtol=0.05)
    along = np.sum(gradient.conj() * amplitude / scale, axis=0)[strong].real
    np.testing.assert_allclose(
        along, (size * np.linalg.norm(amplitude / scale, axis=0))[strong], rtol=0.05
    )


def test_powers_that_made_an_image_are_found_again(lattice: Lattice) -> None:
    """An image added up from known powers is taken apart into these."""
    some = [0, len(lattice.points) // 2, len(lattice.points) - 1]
    true = np.zeros(len(lattice.points))
    true[some] = 0.2, 0.5, 0.3
    image = np.abs(lattice.alike.astype(np.complex128)) ** 2 @ true
    made = replace(lattice, echo=np.sqrt(image).astype(np.complex64))
    for pair in made.heard:
        found = powers(made, pair)
        assert (found >= 0.0).all()
        again = np.abs(lattice.alike[pair].astype(np.complex128)) ** 2 @ found
        np.testing.assert_allclose(again / again.max(), image[pair] / image[pair].max(), atol=1e-3)
        # One pair may hear neighbours alike, and they share what is there.
        centre = found @ lattice.points
        assert np.linalg.norm(centre - true @ lattice.points) < 0.15


def test_music_resolves_what_the_matched_filter_does_not(scatterers) -> None:
    """Two points on one ray, closer than the range cell, make one peak of power and two of MUSIC.

    The range cell of 200 MHz is 0.75 m for a device that hears itself, the points are 0.45 m apart.
    """
    device = 0
    near, far = 1.3, 1.75
    probe = scatterers(ONE, freq_min_hz=5.0e9, freq_max_hz=5.2e9, own_device_links="only")
    origin = probe.evidence.layout.rx_xyz[probe.evidence.layout.rx_device == device].mean(axis=0)
    ray = ONE[0] - origin
    ray /= np.linalg.norm(ray)
    made = scatterers(
        origin + np.array([[near], [far]]) * ray,
        freq_min_hz=5.0e9, freq_max_hz=5.2e9, own_device_links="only",
    )  # fmt: skip
    model = PointModel(made.evidence)
    pair = model.pairs.index((device, device))
    distance = np.arange(0.8, 2.4, 0.01)
    points = origin + distance[:, None] * ray
    measured = model.measurements()[pair]
    window = window_of(model.subcarriers)
    sharp = pseudo_spectrum(model, pair, measured, window, points)
    echoes = model.phasors(points, pair).reshape(-1, len(points))
    plain = np.abs(measured.ravel() @ echoes.conj()) ** 2

    def peaks(curve: np.ndarray) -> np.ndarray:
        inner = curve[1:-1]
        top = (inner > curve[:-2]) & (inner > curve[2:]) & (inner > 0.5 * curve.max())
        return distance[1:-1][top]

    assert len(peaks(plain)) == 1
    np.testing.assert_allclose(peaks(sharp), [near, far], atol=0.03)


def test_windows_stay_within_runs_of_visible_subcarriers() -> None:
    visible = np.array([0, 1, 2, 3, 4, 5, 8, 9, 10, 20])
    assert [run.tolist() for run in runs_of(visible)] == [[*range(6)], [8, 9, 10], [20]]
    assert window_of(visible).tolist() == [0, 2]
    assert len(window_of(np.array([0, 2, 4]))) < 2


def test_many_voxels_are_looked_at_in_blocks() -> None:
    grid = Grid((1.0, 2.0, 0.0), (6, 4, 5))
    search = np.arange(grid.size)[::-1].copy()
    points, block = blocks_of(grid, search)
    np.testing.assert_allclose(points[block], grid.centres(search))
    points, block = blocks_of(grid, search, most=20)
    # Blocks of 2 x 2 x 2 voxels are 18.
    assert len(points) == 18 and np.bincount(block).max() == 8
    assert np.abs(points[block] - grid.centres(search)).max() == pytest.approx(grid.voxel_m / 2)


def test_without_neighbouring_subcarriers_music_says_so(scatterers) -> None:
    evidence = scatterers(ONE).evidence
    every_other = evidence.subcarrier_visible & (np.arange(32) % 2 == 0)
    delta = np.where(every_other, evidence.delta, np.nan)
    apart = replace(evidence, delta=delta, subcarrier_visible=every_other)
    found = BASELINES["music"](apart)
    assert found.score is None and "neighbouring subcarriers" in found.reason
