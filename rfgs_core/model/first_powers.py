# SPDX-License-Identifier: Apache-2.0
"""Levels that a fit begins with: reflected powers, noise, and the scale of the head."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.delay_power import DelayPowerModel
from rfgs_core.model.first_gaussians import START_SCALES_M
from rfgs_core.model.head import SHARPNESS, RadioHead, dimming
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import TrainConfig

#: Gaussians whose maps fit into memory, and those that tell the level of more.
_MANY, _FEW = 20_000, 5000


def visibility(
    points: Float[np.ndarray, "M 3"], normals: Float[np.ndarray, "M 3"], model: DelayPowerModel
) -> Float[np.ndarray, "map M"]:
    """How much of a Gaussian each map's antennas see, by the propagation model's own rule."""
    rows = []
    for entry in model.maps:
        seen = np.ones(len(points))
        for antenna in (entry.tx_xyz.mean(axis=0), entry.rx_xyz.mean(axis=0)):
            towards = antenna - points
            towards /= np.linalg.norm(towards, axis=1, keepdims=True)
            seen /= dimming(SHARPNESS * np.sum(normals * towards, axis=1))
        # Squared: visibility scales the amplitude.
        rows.append(seen**2)
    return np.array(rows, dtype=np.float32)


def fit_power(
    observations: Observations,
    gaussians: Gaussians,
    shares: Float[np.ndarray, "M"] | None = None,
) -> Float[Tensor, "M"]:
    """Reflected powers from delay–angle maps, at the level of the typical map.

    Each map has a gain of its own against the model: wall bounces and the neighbours of an
    antenna lift or lower whole device pairs.

    Args:
        observations: The frame.
        gaussians: Where they are and how they face.
        shares: How powers are to each other; None: equal.
    """
    shares = np.ones(len(gaussians)) if shares is None else shares
    points = gaussians.means.numpy().astype(np.float64)
    model = DelayPowerModel(observations, points)
    seen = visibility(points, gaussians.rotations[:, :, 2].numpy(), model)
    start = model.scaled(shares.astype(np.float32), seen)
    gain = [
        data.sum() / max(float(model.expected(k, start * seen[k]).sum()), 1e-30)
        for k, (_, _, data) in enumerate(model.parts)
    ]
    # The level that suits the typical pair: the median keeps shadowed pairs out of it.
    return torch.from_numpy((start * np.median(gain)).astype(np.float32))


def level_of_power(observations: Observations, gaussians: Gaussians) -> Float[Tensor, "M"]:
    """One reflected power for all: of many, that which `fit_power` finds for a few among them.

    Of 10⁵ Gaussians its maps would take gigabytes, and of equal shares the level is all that they
    tell.
    """
    count = len(gaussians)
    if count <= _MANY:
        return fit_power(observations, gaussians)
    few = torch.zeros(count, dtype=torch.bool)
    few[torch.linspace(0, count - 1, _FEW, dtype=torch.float64).long()] = True
    total = float(fit_power(observations, gaussians.select(few)).double().sum())
    return torch.full((count,), total / count)


def noise_per_link(
    observations: Observations, target: Tensor, share: float
) -> Float[Tensor, "link"]:
    """Variance per link: a share of the mean power of its device pair."""
    pair, names = observations.pairs
    index = pair[observations.links]
    power = (target.abs() ** 2).mean(dim=1).cpu().numpy()
    mean = np.bincount(index, power, len(names)) / np.bincount(index, minlength=len(names))
    floor = 1e-3 * mean.max() if len(mean) else 0.0
    return torch.from_numpy((share * np.maximum(mean, floor * 1e-3))[index].astype(np.float32))


def new_head(
    observations: Observations, config: TrainConfig, power: Float[Tensor, "M"]
) -> RadioHead:
    """A head scaled so that typical reflectivities are features of about one."""
    wavelength_m = SPEED_OF_LIGHT / observations.centre_hz
    return RadioHead.create(
        sub_seed(config.seed, "head"),
        wavelength_m,
        START_SCALES_M[0],
        float(power.mean().sqrt().clamp(min=1e-9)),
    )
