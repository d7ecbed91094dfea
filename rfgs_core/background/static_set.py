# SPDX-License-Identifier: Apache-2.0
"""Gaussians of what stands still, fitted to the background channel of a run.

The background (empty-room capture, or learned from the frames) less the direct paths is put
through the matched filter, and Gaussians are drawn where its power is. What mirrors a wave from
one antenna to another lies across the bisector of the two directions, so that each Gaussian
faces along the bisector of the device pair it was drawn for. Reflectivities are the posterior
mean over all Gaussians so far; further rounds draw from what these leave.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Complex64, Float, Float64
from scipy.spatial import KDTree
from torch import Tensor
from tqdm import tqdm

from rfgs_core.bodies.localise import PairMaps, pair_maps
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.direct_path import direct_background
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.first_gaussians import START_SCALES_M, gaussians_at
from rfgs_core.model.first_powers import noise_per_link
from rfgs_core.model.head import RadioHead
from rfgs_core.model.reflectivity import posterior_mean
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.levels import decibels
from rfgs_core.seeds import sub_seed

#: Drawn in so many rounds, each from what the earlier ones leave.
ROUNDS = 4
#: Exponent of the matched filter's power: its peaks stand out of its side lobes.
PEAK_EXPONENT = 2.0
#: Nothing stands nearer to an antenna [m]: 1/d would let it explain that antenna alone.
NEAREST_M = 0.1
#: Share of each device pair's power that need not be explained.
UNEXPLAINED = 0.02
#: Conjugate-gradient steps of each round.
SOLVER_STEPS = 20
#: Less than this share of the background's power, beside its direct paths, is nothing.
LEAST_SHARE = 1e-9
#: Opacity for display; static Gaussians throw no shadow on what they were fitted to.
OPACITY = 0.3


@dataclass(frozen=True)
class StaticSet:
    """Gaussians that all frames share."""

    gaussians: Gaussians
    """The Gaussians; reflectivity and ρ in their features."""
    head: RadioHead
    """Decodes these features; walls reflect more than bodies, so it has a scale of its own."""

    @property
    def gamma(self) -> Complex64[np.ndarray, "M"]:
        """Complex reflectivity of each [m]."""
        return self.head.gamma(self.gaussians.features).numpy().astype(np.complex64)

    @property
    def power_db(self) -> Float[np.ndarray, "M"]:
        """|γ|² of each [dB, relative to 1 m²]."""
        power = np.abs(self.gamma.astype(np.complex128)) ** 2
        return decibels(power).astype(np.float32)

    def away_from(self, antennas: Float[np.ndarray, "N 3"]) -> StaticSet:
        """The set less what stands nearer to one of the antennas than `NEAREST_M`."""
        far = _far(self.gaussians.means.numpy().astype(np.float64), antennas)
        return StaticSet(self.gaussians.select(torch.from_numpy(far)), self.head)

    def background(self, observations: Observations) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Direct paths and what the set scatters, on every measured link and subcarrier."""
        csi = direct_background(observations)
        everything = np.ones(len(observations.freq_hz), dtype=bool)
        channel = Channel.of(observations, observations.layout.measured, everything)
        with torch.no_grad():
            csi[channel.tx, channel.rx] += channel.scattered(self.head, self.gaussians).numpy()
        return csi


def fit_static_set(observations: Observations, count: int, seed: int) -> StaticSet:
    """Gaussians that explain the background of some observations.

    Args:
        observations: Any frame; only its `static` is read, complex (`--observe complex`).
        count: Number of Gaussians.
        seed: Seed of places and features.

    Returns:
        The set; without any Gaussian where direct paths explain the background.
    """
    seen = observations.links[..., None] & observations.subcarriers
    unexplained = np.where(seen, observations.static - direct_background(observations), 0)
    rest = observations.with_delta(unexplained)
    least = LEAST_SHARE * float(np.sum(np.abs(observations.static) ** 2))
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    target = torch.from_numpy(rest.delta[observations.links][:, observations.subcarriers])
    head = _head(observations, seed)
    if float(np.sum(np.abs(unexplained) ** 2)) <= least or count == 0:
        return StaticSet(Gaussians.none(), head)
    noise = noise_per_link(rest, target, UNEXPLAINED)
    rng = np.random.default_rng(sub_seed(seed, "places"))
    gaussians, scattered = Gaussians.none(), torch.zeros_like(target)
    gamma = torch.zeros(0, dtype=torch.complex64)
    for part in tqdm(np.array_split(np.arange(count), ROUNDS), desc="static set", unit="round"):
        residual = rest.with_entries((target - scattered).numpy())
        gaussians = Gaussians.join(gaussians, _drawn(residual, len(part), rng))
        power = _level(channel, head, gaussians, target, noise, rng)
        gamma = posterior_mean(channel, head, gaussians, target, noise, power, SOLVER_STEPS)
        with torch.no_grad():
            scattered = channel.scattered(head, gaussians, gamma)
    typical = float((gamma.abs() ** 2).mean().sqrt().clamp(min=1e-9))
    head = replace(head, gamma_scale_m=typical)
    return StaticSet(replace(gaussians, features=head.with_gamma(gaussians.features, gamma)), head)


def _head(observations: Observations, seed: int) -> RadioHead:
    """The head of the set, before its scale is known."""
    wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
    return RadioHead.create(sub_seed(seed, "head"), wavelength_m, START_SCALES_M[0], 1.0)


def _drawn(residual: Observations, count: int, rng: np.random.Generator) -> Gaussians:
    """Gaussians where the residual echoes, as many for each device pair that hears one."""
    maps = pair_maps(residual)
    antennas = np.concatenate([residual.layout.tx_xyz, residual.layout.rx_xyz])
    heard = [pair for pair, power in enumerate(maps.power) if power.any()]
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for pair, share in zip(heard, np.array_split(np.arange(count), len(heard)), strict=True):
        points.append(_places(maps, pair, len(share), antennas, residual.bounds_m, rng))
        normals.append(_bisectors(points[-1], maps.tx_xyz[pair], maps.rx_xyz[pair]))
    gaussians = gaussians_at(np.concatenate(points), np.concatenate(normals))
    opacity = torch.full((len(gaussians),), OPACITY)
    return replace(gaussians, logit_opacities=torch.logit(opacity))


def _places(
    maps: PairMaps,
    pair: int,
    count: int,
    antennas: Float64[np.ndarray, "N 3"],
    bounds_m: Float64[np.ndarray, "2 3"],
    rng: np.random.Generator,
) -> Float64[np.ndarray, "count 3"]:
    """Places drawn with the power of a pair's map, spread within its cells."""
    power = maps.power[pair].astype(np.float64)
    cells = np.indices(power.shape).reshape(3, -1).T
    centres = maps.origin_m + maps.spacing_m * cells
    # Half a cell's diagonal more, so that no place within a cell is too near.
    far = _far(centres, antennas, NEAREST_M + maps.spacing_m)
    weight = (power / power.max()).ravel() ** PEAK_EXPONENT * far
    chosen = rng.choice(len(centres), size=count, p=weight / weight.sum())
    half_m = 0.5 * maps.spacing_m
    return np.clip(centres[chosen] + rng.uniform(-half_m, half_m, (count, 3)), *bounds_m)


def _far(
    points: Float64[np.ndarray, "M 3"],
    antennas: Float[np.ndarray, "N 3"],
    least_m: float = NEAREST_M,
) -> np.ndarray:
    """Which points keep away from all antennas."""
    distance_m, _ = KDTree(antennas).query(points, distance_upper_bound=least_m)
    return np.isinf(np.asarray(distance_m))


def _bisectors(
    points: Float64[np.ndarray, "N 3"],
    tx_xyz: Float64[np.ndarray, "3"],
    rx_xyz: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, "N 3"]:
    """Directions halfway between those to the two ends; to one of them right between the ends."""
    ends = [end - points for end in (tx_xyz, rx_xyz)]
    towards = [end / np.linalg.norm(end, axis=1, keepdims=True) for end in ends]
    middle = towards[0] + towards[1]
    length = np.linalg.norm(middle, axis=1, keepdims=True)
    return np.where(length > 1e-6, middle / np.maximum(length, 1e-6), towards[0])


def _level(
    channel: Channel,
    head: RadioHead,
    gaussians: Gaussians,
    target: Tensor,
    noise: Float[Tensor, "link"],
    rng: np.random.Generator,
) -> Float[Tensor, "M"]:
    """One prior power for all: that with which they would scatter as much as was heard."""
    parts = rng.standard_normal((2, len(gaussians))) / np.sqrt(2)
    trial = torch.from_numpy((parts[0] + 1j * parts[1]).astype(np.complex64))
    with torch.no_grad():
        expected = channel.scattered(head, gaussians, trial)
    heard, would = (((x.abs() ** 2).sum(dim=1) / noise).mean() for x in (target, expected))
    return (heard / would.clamp(min=1e-30)).expand(len(gaussians)).clone()
