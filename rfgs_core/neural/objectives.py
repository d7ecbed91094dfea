# SPDX-License-Identifier: Apache-2.0
"""What neural fields are fitted to: the paper's features, or powers that scatterers would cause."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import torch
from jaxtyping import Float, Float64
from torch import Tensor

from rfgs_core.bodies.localise import PairMaps, pair_maps
from rfgs_core.bodies.start import StartDensity
from rfgs_core.fit.losses import FEATURE_WEIGHT, POSITION_WEIGHT, SamplePoints
from rfgs_core.measure.observations import Observations
from rfgs_core.model.delay_power import DelayPowerModel
from rfgs_core.neural.fields import FieldValues, LogPrior, NeuralField
from rfgs_core.neural.rays import Occupancy, Rays, ending_weights
from rfgs_core.neural.settings import FieldSettings

#: Steps between two looks at which cells are empty.
OCCUPANCY_EVERY = 16
#: Logarithm that stands for a prior of zero: far below any density that a field can reach.
NOTHING = -30.0
#: Sets of scatterers that take turns, so that a field is asked at more places than one set has.
SETS = 6
#: Share of scatterers that lie anywhere, and the rest where the matched filter answers.
ANYWHERE = 0.2


class FieldTask(Protocol):
    """A loss of one frame, and the score of a place that follows from what it teaches."""

    def loss(self, field: NeuralField, step: int) -> Float[Tensor, ""]:
        """Loss of one step; steps count from zero."""
        ...

    def log_score(
        self, values: tuple[np.ndarray, np.ndarray], log_prior: np.ndarray, voxel_m: float
    ) -> Float64[np.ndarray, "N"]:
        """Logarithm of reflected power at places, from log densities and features there."""
        ...


def _prior_of(prior: LogPrior | None, xyz: Float[Tensor, "N 3"]) -> Float[Tensor, "N"]:
    if prior is None:
        return xyz.new_zeros(len(xyz))
    found = np.maximum(prior(xyz.numpy().astype(np.float64)), NOTHING)
    return torch.from_numpy(found).float()


class FeatureTask:
    """Equations 5 and 6 of the paper for a field, on the sample points of its section 3.2.

    Where a Gaussian would be drawn to a sample point p_k with the weight ‖φ(p_k)‖, a ray from an
    antenna through p_k shall end there: points are drawn by that weight, and the mean of −log of
    the ray's chance to end at p_k (Deng et al., CVPR 2022) takes the place of eq. 5. Eq. 6 holds
    for the features that the ray renders, and for those at points anywhere. Eq. 7 is about scales
    and opacities, which a field does not have.
    """

    def __init__(
        self,
        observations: Observations,
        points: SamplePoints,
        radius_m: float,
        settings: FieldSettings,
        prior: LogPrior | None,
    ) -> None:
        """The task on sample points, whose cells have a standard deviation of `radius_m`."""
        self.points, self.radius_m = points, radius_m
        self.settings, self.prior = settings, prior
        self.generator = torch.Generator().manual_seed(settings.seed % (1 << 63))
        self.bounds_m = torch.from_numpy(observations.bounds_m).float()
        weight = torch.linalg.norm(self.points.features, dim=1).double()
        self.weight = weight**settings.contrast * _prior_of(prior, self.points.xyz).double().exp()
        self.antennas = torch.from_numpy(_receivers(observations)).float()
        self.occupancy = None
        if settings.kind == "ngp":
            self.occupancy = Occupancy(self.bounds_m, self.generator)

    def loss(self, field: NeuralField, step: int) -> Float[Tensor, ""]:
        """Ends of rays, features along them, features anywhere, and what rays may pass."""
        count = self.settings.rays
        if self.occupancy is not None and step % OCCUPANCY_EVERY == 0:
            self.occupancy.update(field)
        chosen = torch.multinomial(self.weight, count, replacement=True, generator=self.generator)
        anywhere = torch.randint(len(self.points.xyz), (count,), generator=self.generator)
        at, other = self.points.rows(chosen), self.points.rows(anywhere)
        rays = self._rays(torch.cat([at.xyz, other.xyz]))
        values = self._ask(field, rays)
        log_density = values.log_density.reshape(rays.length_m.shape)
        ends = ending_weights(log_density, rays.length_m)[:count]
        here = (ends * rays.own[:count]).sum(dim=1) / rays.length_m[:count, 0]
        position = -torch.log(here + 1e-6).mean()
        depth = (torch.exp(log_density) * rays.length_m)[count:].sum(dim=1).mean()
        features = values.features.reshape(*log_density.shape, -1)
        rendered = (ends[..., None] * features[:count]).sum(dim=1)
        feature = torch.sum((rendered - at.features) ** 2, dim=1).mean()
        own = (features[count:] * rays.own[count:, :, None]).sum(dim=1)
        feature = feature + torch.sum((own - other.features) ** 2, dim=1).mean()
        position = position + self.settings.passing * depth
        return POSITION_WEIGHT * position + FEATURE_WEIGHT * feature

    def _rays(self, points: Float[Tensor, "ray 3"]) -> Rays:
        """Rays from any antennas through points."""
        antenna = torch.randint(len(self.antennas), (len(points),), generator=self.generator)
        return Rays.through(
            points, self.antennas[antenna], self.bounds_m,
            self.settings.samples_per_ray, self.radius_m, self.generator,
        )  # fmt: skip

    def _ask(self, field: NeuralField, rays: Rays) -> FieldValues:
        """The field at the places of rays; where it is known to be empty, nothing."""
        xyz, extent_m = rays.xyz.reshape(-1, 3), rays.extent_m.reshape(-1, 3)
        log_prior = _prior_of(self.prior, xyz)
        if self.occupancy is None:
            values = field(xyz, extent_m)
            return FieldValues(values.log_density + log_prior, values.features)
        asked = self.occupancy.occupied(xyz) | (rays.own.reshape(-1) > 0.0)
        some = field(xyz[asked], extent_m[asked])
        density = xyz.new_full((len(xyz),), NOTHING)
        features = xyz.new_zeros(len(xyz), some.features.shape[1])
        return FieldValues(
            density.masked_scatter(asked, some.log_density) + log_prior,
            features.index_put((asked,), some.features),
        )

    def log_score(
        self, values: tuple[np.ndarray, np.ndarray], log_prior: np.ndarray, voxel_m: float
    ) -> Float64[np.ndarray, "N"]:
        """α ‖f‖², what `--recipe paper` takes for the reflected power of a Gaussian."""
        log_density, features = values
        opacity = -np.expm1(-np.exp((log_density + log_prior).astype(np.float64)) * voxel_m)
        return np.log(np.maximum(opacity * np.sum(features**2, axis=1), 1e-300))


class PropagationTask:
    """Delay–angle powers of scatterers whose reflected power is the density at their places.

    Every device pair's map is compared as a distribution over delays and beams, −Σ m log E[m], so
    that neither gains nor the speckle of peaks decide; see `DelayPowerModel`.
    """

    def __init__(
        self,
        observations: Observations,
        settings: FieldSettings,
        density: StartDensity | None,
        prior: LogPrior | None,
    ) -> None:
        rng = np.random.default_rng(settings.seed)
        self.evenness = settings.evenness
        self.sets = [
            _Scatterers.drawn(observations, settings.scatterers, density, prior, rng)
            for _ in range(SETS)
        ]

    def loss(self, field: NeuralField, step: int) -> Float[Tensor, ""]:
        """Mean cross-entropy over the maps, with one of the sets."""
        return self.sets[step % SETS].loss(field, self.evenness)

    def log_score(
        self, values: tuple[np.ndarray, np.ndarray], log_prior: np.ndarray, voxel_m: float
    ) -> Float64[np.ndarray, "N"]:
        """The density itself."""
        return values[0].astype(np.float64) + log_prior


class _Scatterers:
    """Places of scatterers, the volume that each stands for, and what maps they cause."""

    def __init__(
        self,
        model: DelayPowerModel,
        points: Float64[np.ndarray, "N 3"],
        log_volume: Float[Tensor, "N"],
    ) -> None:
        self.xyz, self.log_volume = torch.from_numpy(points).float(), log_volume
        self.maps = []
        for delays, beams, power in model.parts:
            measured = torch.from_numpy(power / max(float(power.sum()), 1e-30)).float()
            scale = 1.0 / max(float(np.mean(delays)), 1e-30)
            parts = torch.from_numpy(delays * np.float32(scale)), torch.from_numpy(beams)
            self.maps.append((*parts, measured))

    @staticmethod
    def drawn(
        observations: Observations,
        count: int,
        density: StartDensity | None,
        prior: LogPrior | None,
        rng: np.random.Generator,
    ) -> _Scatterers:
        """Scatterers where bodies are likely, or where the matched filter answers."""
        if density is not None:
            points = density.draw(count, rng)
            # Drawn by the prior: prior over chance is the same for all.
            log_volume = torch.zeros(count)
        else:
            points, log_chance = drawn_by_power(pair_maps(observations), count, rng)
            log_volume = _prior_of(prior, torch.from_numpy(points).float())
            log_volume = log_volume - torch.from_numpy(log_chance).float()
        return _Scatterers(DelayPowerModel(observations, points), points, log_volume)

    def loss(self, field: NeuralField, evenness: float) -> Float[Tensor, ""]:
        """Mean cross-entropy, and the weighted mean square of log densities."""
        log_density = field(self.xyz, torch.full_like(self.xyz, 0.02)).log_density
        power = torch.softmax(log_density + self.log_volume, dim=0)
        total = power.new_zeros(())
        for delays, beams, measured in self.maps:
            expected = (delays * power) @ beams
            expected = expected / expected.sum().clamp(min=1e-30)
            total = total - torch.sum(measured * torch.log(expected + 1e-6 / expected.numel()))
        return total / max(len(self.maps), 1) + evenness * (log_density**2).mean()


def drawn_by_power(
    maps: PairMaps, count: int, rng: np.random.Generator
) -> tuple[Float64[np.ndarray, "count 3"], Float64[np.ndarray, "count"]]:
    """Places drawn by the log-mean of matched-filter powers, some of them anywhere.

    Returns:
        Places [m] and the logarithm of the chance per cell of the maps' grid.
    """
    share = np.exp(np.log(maps.power + 1e-3).mean(axis=0))
    share = (1.0 - ANYWHERE) * share / share.sum() + ANYWHERE / share.size
    cell = rng.choice(share.size, size=count, p=share.ravel())
    index = np.stack(np.unravel_index(cell, share.shape), axis=1)
    points = maps.origin_m + (index + rng.uniform(-0.5, 0.5, (count, 3))) * maps.spacing_m
    return points, np.log(share.ravel()[cell])


def _receivers(observations: Observations) -> Float64[np.ndarray, "device 3"]:
    """Centres of the receiving arrays that hear something [m]."""
    layout = observations.layout
    hears = observations.links.any(axis=0)
    devices = np.unique(layout.rx_device[hears])
    return np.stack([layout.rx_xyz[layout.rx_device == one].mean(axis=0) for one in devices])
