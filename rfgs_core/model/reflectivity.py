# SPDX-License-Identifier: Apache-2.0
"""Reflectivities of fixed Gaussians: the posterior mean of a linear Gaussian model.

The channel is linear in the reflectivities γ. With γ_i ~ CN(0, p_i), where p_i is the
reflected power of the phase-free fit, and noise of variance σ² per device pair, the posterior
mean minimises Σ |y − Aγ|²/σ² + Σ |γ_i|²/p_i. Conjugate gradients solve for x = γ/√p. Of powers
per subcarrier the hologram is linear in real and imaginary parts, which is all that they ask for.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from jaxtyping import Complex, Float
from torch import Tensor

from rfgs_core.device import on_device
from rfgs_core.gaussians import Gaussians
from rfgs_core.measure.observations import Observations
from rfgs_core.model.channel import Channel
from rfgs_core.model.comparison import Comparison, comparison_of
from rfgs_core.model.first_powers import noise_per_link
from rfgs_core.model.head import RadioHead


def fitted_reflectivities(
    observations: Observations,
    head: RadioHead,
    gaussians: Gaussians,
    power: Float[Tensor, "M"],
    unexplained: float,
    iterations: int,
) -> Complex[Tensor, "M"] | None:
    """Posterior-mean reflectivities [m] that explain a frame beside the Gaussians' shadow.

    Args:
        observations: The frame.
        head: Decodes ρ and opacities.
        gaussians: Fixed Gaussians.
        power: Prior variance of each reflectivity [m²].
        unexplained: Share of each device pair's power that is left as noise.
        iterations: Conjugate-gradient steps.

    Returns:
        One per Gaussian; None where the radio reports powers per delay, which have no phases.
    """
    device = gaussians.means.device
    comparison = on_device(comparison_of(observations), device)
    channel = Channel.of(observations, observations.links, observations.subcarriers)
    with torch.no_grad():
        shadow = comparison.linear(channel.shadowed(head, gaussians))
    if shadow is None:
        return None
    measured = comparison.measured()
    noise = noise_per_link(observations, measured, unexplained).to(device)
    target = measured - shadow
    return posterior_mean(channel, head, gaussians, target, noise, power, iterations, comparison)


def posterior_mean(
    channel: Channel,
    head: RadioHead,
    gaussians: Gaussians,
    target: Tensor,
    noise: Float[Tensor, "link"],
    power: Float[Tensor, "M"],
    iterations: int,
    comparison: Comparison | None = None,
) -> Complex[Tensor, "M"]:
    """Posterior-mean reflectivities [m].

    Args:
        channel: Links and subcarriers of `target`.
        head: Decodes ρ; its reflectivities are ignored.
        gaussians: Fixed positions, shapes and normals.
        target: Channel change to explain, (link, entry), as `comparison` puts it.
        noise: Variance of what cannot be explained, per link.
        power: Prior variance p of each reflectivity [m²].
        iterations: Conjugate-gradient steps.
        comparison: What of the change is reported; None: all of it.
    """
    root, weight = torch.sqrt(power), torch.rsqrt(noise)[:, None]
    zero = torch.zeros_like(root, dtype=torch.complex64).requires_grad_(True)

    def reported(gamma: Tensor) -> Tensor:
        change = channel.scattered(head, gaussians, gamma)
        seen = change if comparison is None else comparison.linear(change)
        assert seen is not None
        return seen

    def forward(x: Tensor) -> Tensor:
        with torch.no_grad():
            return reported(root * x) * weight

    # The model is linear in γ, so its gradient at zero is the adjoint everywhere.
    linear = reported(zero)

    def adjoint(y: Tensor) -> Tensor:
        # The gradient is y's; given as such, torch would load SymPy to compare two shapes.
        likeness = (linear * (y * weight).conj()).real.sum()
        (grad,) = torch.autograd.grad(likeness, zero, retain_graph=True)
        return root * grad

    return root * _conjugate_gradients(forward, adjoint, target * weight, iterations)


def _conjugate_gradients(
    forward: Callable[[Tensor], Tensor],
    adjoint: Callable[[Tensor], Tensor],
    y: Tensor,
    iterations: int,
) -> Complex[Tensor, "M"]:
    """Solves (I + BᴴB) x = Bᴴ y."""
    residual = adjoint(y)
    x = torch.zeros_like(residual)
    step = residual.clone()
    energy = torch.vdot(residual, residual).real
    for _ in range(iterations):
        if energy <= 0:
            break
        image = step + adjoint(forward(step))
        along = energy / torch.vdot(step, image).real
        x = x + along * step
        residual = residual - along * image
        after = torch.vdot(residual, residual).real
        step = residual + after / energy * step
        energy = after
    return x
