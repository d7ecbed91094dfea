# SPDX-License-Identifier: Apache-2.0
"""Neural fields as evaluation sees them: a Gaussian in each of the best voxels of every frame."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset import Dataset
from rfgs_core.encode import MATCHED_FILTER
from rfgs_core.evaluate.geometry import BEST_K_FACTOR, best_voxels, voxel_budget
from rfgs_core.evaluate.grid import Grid
from rfgs_core.fit.losses import SamplePoints
from rfgs_core.fit.sampling import sample_points
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.first_gaussians import gaussians_at
from rfgs_core.model.first_powers import fit_power, new_head
from rfgs_core.model.head import RadioHead
from rfgs_core.model.reflectivity import fitted_reflectivities
from rfgs_core.neural.fit import FittedField, StartPrior, fit_field
from rfgs_core.neural.settings import FieldSettings
from rfgs_core.radio.levels import decibels
from rfgs_core.run import Run
from rfgs_core.run.config import RunConfig, relative_dataset
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig
from rfgs_core.threads import one_torch_thread

#: Standard deviation of a Gaussian that stands for a voxel of 4 cm: it does not reach the next [m].
VOXEL_SCALE_M = 0.012


class Given(NamedTuple):
    """What all fields of a frame share."""

    points: SamplePoints
    """Sample points of the paper's losses."""
    prior: StartPrior
    """What RF-GS takes for likely of bodies."""

    @staticmethod
    def of(observations: Observations, config: TrainConfig, seed: int) -> Given:
        """Sample points with the default encoder, and bodies as RF-GS finds them.

        Raises:
            RfgsError: Nobody changes the channel.
        """
        rng = np.random.default_rng(seed)
        with one_torch_thread():
            points = sample_points(
                observations, config.grid_side, rng, MATCHED_FILTER, config.refine_levels
            )
            return Given(points, StartPrior.of(observations, config, seed))


#: What is given of a frame.
GivenOf = Callable[[int, Observations], Given]


@dataclass(frozen=True)
class Readout:
    """What a field says of one frame, as Gaussians with reflectivities."""

    gaussians: Gaussians
    """One per voxel."""
    power_db: np.ndarray
    """Reflected power of each."""
    bodies: Bodies | None
    """Where it takes bodies to be; None without a prior."""


@dataclass(frozen=True)
class FieldRun(Run):
    """Fields of all frames, with what evaluation asks of a run."""

    readouts: dict[int, Readout] = field(default_factory=dict)
    """What each frame's field says."""
    shared_head: RadioHead | None = None
    """Decodes reflectivities; the first frame's, as of Gaussians."""

    @staticmethod
    def over(
        dataset: Dataset, radio: str, frames: list[int], config: TrainConfig, out: Path
    ) -> FieldRun:
        """A run of some frames that says nothing yet."""
        name, place = dataset.sequence().name, relative_dataset(out, dataset.path)
        told = RunConfig(place, dataset.fingerprint, name, radio, frames, config)
        return FieldRun(out, told)

    def moving(self, frame: int) -> Gaussians:
        """Gaussians of a frame."""
        return self.readouts[frame].gaussians

    def gaussians(self, frame: int) -> Gaussians:
        """The same: nothing stands still."""
        return self.moving(frame)

    def attributes(self, frame: int) -> dict[str, np.ndarray]:
        """Features and reflected powers of a frame's Gaussians."""
        found = self.readouts[frame]
        features = found.gaussians.features.numpy()
        return {"features": features, "rf_power_db": found.power_db.astype(np.float32)}

    def bodies(self, frame: int) -> Bodies | None:
        """Where bodies are taken to be."""
        found = self.readouts.get(frame)
        return None if found is None else found.bodies

    @property
    def head(self) -> RadioHead:
        """Decodes reflectivities from features."""
        assert self.shared_head is not None
        return self.shared_head


def fit_fields(
    dataset: Dataset,
    radio: str,
    frames: list[int],
    settings: FieldSettings,
    config: TrainConfig,
    given_of: GivenOf,
    out: Path,
) -> FieldRun:
    """Fits a field to each frame by itself; nothing is written.

    Args:
        dataset: The data, of one sequence.
        radio: Which radio.
        frames: Which frames.
        settings: Which field; its seed is the root of those of the frames.
        config: How bodies are found and reflectivities solved, as RF-GS has it.
        given_of: What fields of a frame share; its time is not counted.
        out: A folder that paths of the result are relative to.

    Raises:
        RfgsError: Nobody changes the channel of a frame.
    """
    sequence = dataset.sequence()
    run = FieldRun.over(dataset, radio, frames, config, out)
    grid, voxels = Grid.over(sequence.bounds_m), voxel_budget(sequence.instances)
    spent, head = 0.0, None
    for frame in frames:
        observations = run.observations(frame)
        given = given_of(frame, observations)
        own = replace(settings, seed=sub_seed(settings.seed, sequence.name, radio, frame, "field"))
        begin = time.perf_counter()
        with one_torch_thread():
            fitted = fit_field(observations, own, config, given.points, given.prior)
            score = fitted.score(grid.centres(), grid.voxel_m)
            best = best_voxels(score.reshape(grid.shape), BEST_K_FACTOR * voxels)
            places, shares = grid.centres(best), score[best]
            found, head = _read_out(fitted, places, shares, observations, config, head)
        spent += time.perf_counter() - begin
        run.readouts[frame] = found
    return replace(run, shared_head=head, config=replace(run.config, train_s=round(spent, 2)))


def _read_out(
    fitted: FittedField,
    places: np.ndarray,
    shares: np.ndarray,
    observations: Observations,
    config: TrainConfig,
    head: RadioHead | None,
) -> tuple[Readout, RadioHead]:
    """Gaussians in voxels with shares of a power, and reflectivities as RF-GS solves them."""
    normals = fitted.normals(places, VOXEL_SCALE_M)
    gaussians = gaussians_at(places, normals, (VOXEL_SCALE_M, VOXEL_SCALE_M, VOXEL_SCALE_M))
    power = fit_power(observations, gaussians, shares)
    head = head or new_head(observations, config, power)
    features = torch.from_numpy(fitted.field.everywhere(places, VOXEL_SCALE_M)[1])
    features = head.without_readings(features)
    gamma = fitted_reflectivities(
        observations,
        head,
        replace(gaussians, features=features),
        power,
        unexplained=config.unexplained,
        iterations=config.solver_steps,
    )
    assert gamma is not None, "fields are fitted to channels with phases"
    gaussians = replace(gaussians, features=head.with_gamma(features, gamma))
    bodies = None if fitted.prior is None else fitted.prior.bodies
    power_db = decibels(power.numpy().astype(np.float64))
    return Readout(gaussians, np.asarray(power_db), bodies), head
