# SPDX-License-Identifier: Apache-2.0
"""Fields find scatterers that are known, rays end as volume rendering says, and runs repeat."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from rfgs_core.dataset import open_dataset
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.evaluate.field_run import Given, fit_fields
from rfgs_core.evaluate.grid import Grid
from rfgs_core.evaluate.metrics import evaluate_method
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.sampling import sample_points
from rfgs_core.measure.observations import Observations
from rfgs_core.neural.fields import NeuralField
from rfgs_core.neural.fit import fit_field
from rfgs_core.neural.rays import Occupancy, Rays, ending_weights
from rfgs_core.neural.settings import FieldKind, FieldObjective, FieldSettings
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.settings import TrainConfig

PLACE_M = np.array([2.4, 1.4, 1.1])
SMALL = FieldSettings(steps=40, rays=128, samples_per_ray=24, scatterers=400)


@pytest.fixture(scope="module")
def scattered(make_observations: Callable[..., Observations]) -> Observations:
    """One point scatterer in a room that is otherwise as it was."""
    seen = make_observations(num_subcarriers=64, freq_min_hz=5.0e9, freq_max_hz=6.0e9)
    out = np.linalg.norm(seen.layout.tx_xyz - PLACE_M, axis=1)
    back = np.linalg.norm(seen.layout.rx_xyz - PLACE_M, axis=1)
    k = 2 * np.pi * seen.freq_hz / SPEED_OF_LIGHT
    way = (out[:, None] + back)[..., None]
    wave = np.exp(-1j * k * way) / (out[:, None] * back)[..., None]
    return seen.with_delta(np.where(seen.links[..., None], wave, 0.0))


@pytest.fixture(scope="module")
def sampled(scattered: Observations) -> SamplePoints:
    """What every field is told of it."""
    return sample_points(scattered, 12, np.random.default_rng(0), MATCHED_FILTER, 2)


@pytest.mark.parametrize("objective", ["features", "propagation"])
@pytest.mark.parametrize("kind", ["nerf", "mip", "ngp"])
def test_fields_are_dense_where_something_scatters(
    kind: FieldKind, objective: FieldObjective, scattered: Observations, sampled: SamplePoints
) -> None:
    settings = replace(SMALL, kind=kind, objective=objective)
    fitted = fit_field(scattered, settings, TrainConfig(grid_side=12), sampled)
    assert np.mean(fitted.losses[-10:]) < np.mean(fitted.losses[:10])
    (x, y, z), high = scattered.bounds_m.tolist()
    nx, ny, nz = (math.ceil((b - a) / 0.1) for a, b in zip((x, y, z), high, strict=True))
    grid = Grid((x, y, z), (nx, ny, nz), 0.1)
    score = fitted.score(grid.centres(), grid.voxel_m)
    best = grid.centres(np.argsort(-score)[:50])
    assert np.linalg.norm(np.median(best, axis=0) - PLACE_M) < 0.4


def test_rays_end_exponentially_in_even_density() -> None:
    length = torch.full((1, 400), 0.01)
    ends = ending_weights(torch.full((1, 400), math.log(0.7)), length)[0]
    along = 0.01 * torch.arange(400)
    assert torch.allclose(ends, torch.exp(-0.7 * along) * -math.expm1(-0.007), atol=1e-6)
    assert float(ends.sum()) == pytest.approx(1.0 - math.exp(-2.8), abs=1e-5)


def test_every_ray_has_its_sample_point_and_stays_within_the_bounds() -> None:
    generator = torch.Generator().manual_seed(0)
    bounds = torch.tensor([[0.0, 0.0, 0.0], [4.0, 3.0, 2.5]])
    points = 0.1 + torch.rand(200, 3, generator=generator) * (bounds[1] - 0.2)
    origins = torch.rand(200, 3, generator=generator) * bounds[1]
    rays = Rays.through(points, origins, bounds, 16, 0.05, generator)
    assert torch.allclose(rays.own.sum(dim=1), torch.ones(200))
    through = (rays.xyz * rays.own[..., None]).sum(dim=1)
    far = torch.linalg.norm(points - origins, dim=1) > 0.25
    assert torch.allclose(through[far], points[far], atol=1e-4)
    ended = rays.length_m.sum(dim=1) + 0.2
    away = torch.linalg.norm(rays.xyz - origins[:, None], dim=2).max(dim=1).values
    assert bool((away <= ended + 1e-4).all())
    assert bool((rays.xyz[far] >= -0.3).all()) and bool((rays.extent_m > 0).all())


def test_what_was_empty_for_long_is_not_asked_again() -> None:
    bounds = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    field = NeuralField(FieldSettings(kind="plain", width=16, layers=1), bounds)
    with torch.no_grad():
        field.network[-1].bias[0] = -9.0
    occupancy = Occupancy(torch.from_numpy(bounds).float(), torch.Generator().manual_seed(0))
    middle = torch.full((1, 3), 0.5)
    assert bool(occupancy.occupied(middle))
    looks = 0
    while bool(occupancy.occupied(middle)):
        occupancy.update(field)
        looks += 1
        assert looks < 100
    assert looks > 10, "one look does not tell"


@pytest.mark.slow
def test_fields_of_a_sequence_are_evaluated_as_runs_are(tiny_dataset: Path, tmp_path: Path) -> None:
    dataset = open_dataset(tiny_dataset)
    config = TrainConfig(grid_side=8, solver_steps=2, posture="standing")
    settings = replace(SMALL, steps=5, prior=True)

    given: dict[int, Given] = {}

    def given_of(frame: int, observations: Observations) -> Given:
        # What fields of a frame share is found once, as `rfgs bench table1` does.
        if frame not in given:
            given[frame] = Given.of(observations, config, frame)
        return given[frame]

    runs = [
        fit_fields(dataset, "wifi", [1, 2], settings, config, given_of, tmp_path) for _ in range(2)
    ]
    first, second = (evaluate_method(run)["method"] for run in runs)
    assert first == second
    assert 0.0 < first["geometry"]["f20"] <= 1.0
    assert first["rf"]["element_snr_db"] is not None
    assert runs[0].config.train_s > 0.0
    assert len(runs[0].bodies(1) or ()) == 1
    plain = fit_fields(
        dataset, "wifi", [1], replace(settings, prior=False), config, given_of, tmp_path
    )
    assert plain.bodies(1) is None
