# SPDX-License-Identifier: Apache-2.0
"""The neural shader: radio features to colours, fitted after everything else is frozen.

Colour cannot come from radio. The Gaussians are fitted to channels alone; only then are the
shader's three matrices fitted to training pictures, for display. This module takes geometry as a
finished `FrozenSplats` and features without gradient, so pictures cannot reach the Gaussians.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32
from torch import Tensor

from rfgs_core.adam import Adam
from rfgs_core.arrays import load_arrays, save_arrays
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians.model import FEATURE_DIM
from rfgs_core.render.splat import FrozenSplats
from rfgs_core.seeds import sub_seed
from rfgs_core.threads import one_torch_thread

#: Width of both hidden layers.
HIDDEN = 64

#: Background of a person that stands alone, and the colour of Gaussians without a shader.
MID_GREY = 0.5

_SHAPES = {"W1": (HIDDEN, FEATURE_DIM), "W2": (HIDDEN, HIDDEN), "W3": (3, HIDDEN)}


@dataclass(frozen=True)
class Shader:
    """c = sigmoid(W3 relu(W2 relu(W1 f))), equation 3 of the paper; no biases, as printed there.

    A feature of zeros is therefore mid-grey.
    """

    W1: Float32[Tensor, "64 32"]
    """First matrix; holds the standardisation of the features too."""
    W2: Float32[Tensor, "64 64"]
    """Second matrix."""
    W3: Float32[Tensor, "3 64"]
    """Third matrix."""

    def colors(self, features: Float[Tensor, "M 32"]) -> Float[Tensor, "M 3"]:
        """Colours of radio features, sRGB in (0, 1)."""
        hidden = torch.relu(torch.relu(features @ self.W1.T) @ self.W2.T)
        return torch.sigmoid(hidden @ self.W3.T)

    def save(self, path: Path) -> None:
        """Writes `shader.npz` in one step."""
        save_arrays(path, {name: getattr(self, name).detach().cpu().numpy() for name in _SHAPES})

    @staticmethod
    def load(path: Path) -> Shader:
        """Reads `shader.npz`.

        Raises:
            RfgsError: The file does not exist.
            RfgsFormatError: It is damaged, or its matrices have other shapes or are not finite.
        """
        remedy, types = "fit the shader again with `rfgs train`", dict.fromkeys(_SHAPES, "f4")
        arrays = load_arrays(path, remedy, _SHAPES, types=types)
        return Shader(
            **{name: torch.from_numpy(arrays[name].astype(np.float32)) for name in _SHAPES}
        )


@dataclass(frozen=True)
class ShaderConfig:
    """How the shader is fitted."""

    learning_rate: float
    """Step of Adam."""
    steps: int
    """Steps of Adam."""
    pictures_per_step: int = 4
    """Training pictures whose errors are averaged in one step."""
    seed: int = 0
    """Root seed of the first matrices and of the order of pictures."""

    @staticmethod
    def for_recipe(recipe: str, seed: int = 0) -> ShaderConfig:
        """Rate and steps of a training recipe.

        `paper` has its learning rate 1e-4 and 10,000 steps (section 3.6), one picture each.
        `rfgs` takes far fewer steps at a larger rate: the features are standardised.

        Raises:
            RfgsError: The recipe is unknown.
        """
        if recipe == "paper":
            return ShaderConfig(learning_rate=1e-4, steps=10_000, pictures_per_step=1, seed=seed)
        if recipe == "rfgs":
            return ShaderConfig(learning_rate=1e-2, steps=150, pictures_per_step=3, seed=seed)
        raise RfgsError(f"unknown recipe {recipe!r}; expected paper or rfgs")


@dataclass(frozen=True)
class TrainingView:
    """One training picture and the frozen Gaussians as its camera sees them."""

    plan: FrozenSplats
    """Frozen geometry."""
    features: Float32[Tensor, "M 32"]
    """Radio features, without gradient."""
    target: Float32[Tensor, "H W 3"]
    """The person cut out of the picture, on mid-grey; sRGB in [0, 1]."""
    region: Bool[Tensor, "H W"]
    """Pixels that count: where the person is or a Gaussian is drawn."""

    def loss(self, shader: Shader) -> Tensor:
        """Mean squared colour error inside the region, zero for an empty one."""
        picture = self.plan.draw(shader.colors(self.features)).over(MID_GREY)
        squared = (picture - self.target)[self.region] ** 2
        return squared.sum() / max(1, squared.numel())


def fit_shader(
    views: Sequence[TrainingView],
    config: ShaderConfig,
    on_step: Callable[[float], None] | None = None,
) -> Shader:
    """Fits equation 3 to pictures of frozen Gaussians.

    Features differ in size by orders of magnitude between radios, so each of the 32 is divided by
    its RMS over all views; the division ends up inside W1.

    Args:
        views: Training pictures, all on one device; at least one.
        config: Rate, steps and seed. Same seed, same shader.
        on_step: Called with the loss of every step.

    Returns:
        The fitted shader, detached.

    Raises:
        RfgsError: There is no picture to fit to.
    """
    if not views:
        raise RfgsError("no training picture to fit the shader to; the test split holds them all")
    with one_torch_thread():
        return _fit(views, config, on_step)


def _fit(
    views: Sequence[TrainingView], config: ShaderConfig, on_step: Callable[[float], None] | None
) -> Shader:
    rms = _feature_rms([view.features for view in views])
    generator = torch.Generator().manual_seed(sub_seed(config.seed, "shader"))
    drawn = {
        name: torch.randn(shape, generator=generator) * (2.0 / shape[1]) ** 0.5
        for name, shape in _SHAPES.items()
    }
    weights = {name: value.to(rms.device).requires_grad_() for name, value in drawn.items()}
    optimizer = Adam.of(weights.values(), config.learning_rate)
    for _ in range(config.steps):
        chosen = torch.randint(len(views), (config.pictures_per_step,), generator=generator)
        optimizer.zero_grad()
        losses = [views[index].loss(_standardised(weights, rms)) for index in chosen.tolist()]
        loss = torch.stack(losses).mean()
        loss.backward()
        optimizer.step()
        if on_step is not None:
            on_step(float(loss.detach()))
    final = _standardised(weights, rms)
    return Shader(W1=final.W1.detach(), W2=final.W2.detach(), W3=final.W3.detach())


def _standardised(weights: dict[str, Tensor], rms: Tensor) -> Shader:
    """The shader for raw features: W1 (f / rms) = (W1 / rms) f."""
    return Shader(W1=weights["W1"] / rms, W2=weights["W2"], W3=weights["W3"])


def _feature_rms(features: Sequence[Tensor]) -> Float[Tensor, "32"]:
    stacked = torch.cat(list(features)).double()
    if not torch.isfinite(stacked).all():
        raise RfgsFormatError("radio features hold values that are not finite")
    rms = stacked.square().mean(dim=0).sqrt() if len(stacked) else stacked.new_zeros(FEATURE_DIM)
    # A feature that hardly ever differs from zero must not be blown up to count like the others.
    floor = 1e-3 * rms.max()
    rms = torch.where(rms > floor, rms, floor)
    return torch.where(rms > 0.0, rms, torch.ones_like(rms)).float()
