# SPDX-License-Identifier: Apache-2.0
"""CSI of radio Gaussians: scattering, and shadows on the paths of the empty scene.

    H(f) = sum_p T_p a_p e^(-j 2 pi f tau_p)
         + sum_i gamma_i(f) v_i lambda / ((4 pi)^(3/2) d_t d_r)
           exp(-k^2 q^T Sigma_i q / 2) e^(-j k (d_t + d_r)),   q = u_t + u_r,

k = 2 pi f / c, u the unit vectors from a Gaussian to the two antennas. The Gaussian factor is
the Fourier transform of a Gaussian cloud of scatterers, so a flat one reflects like a mirror.

`scatter` and `shadow` exist three times: compiled for the CPU (`backend="numba"`), for a GPU
(`backend="triton"`), and in plain torch (`backend="torch"`), which is the definition that tests
compare the others with. Where none is named, the device of the Gaussians decides.
"""

from __future__ import annotations

import importlib
import math
from dataclasses import dataclass
from types import ModuleType
from typing import Literal, get_args

import torch
from jaxtyping import Complex, Float
from torch import Tensor

from rfgs_core.device import on_device
from rfgs_core.propagation.geometry import EnvironmentPaths, Links, Subcarriers

__all__ = [
    "EnvironmentPaths",
    "Links",
    "RadioGaussians",
    "Subcarriers",
    "environment",
    "propagate",
    "scatter",
    "shadow",
]

Backend = Literal["numba", "triton", "torch"]
_MODULES = {"numba": "fast", "triton": "gpu", "torch": "reference"}


def scatter(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales_rf: Float[Tensor, "gaussian 3"],
    gamma: Complex[Tensor, "gaussian knot"],
    links: Links,
    subcarriers: Subcarriers,
    normals: Float[Tensor, "gaussian 3"] | None = None,
    sharpness: float = 0.0,
    visibility: Float[Tensor, "gaussian group"] | None = None,
    *,
    backend: Backend | None = None,
) -> Complex[Tensor, "link subcarrier"]:
    """CSI that Gaussians scatter, the second sum of the module's formula.

    Differentiable in all tensors but the links. The precision is that of `scales_rf`; distances
    are always double. v = visibility * sigmoid(sharpness n.u_t) * sigmoid(sharpness n.u_r).

    Args:
        means: Centres [m].
        quats: Orientations, w first, need not be normalised.
        scales_rf: Standard deviations of the reflecting cloud [m], positive.
        gamma: Reflectivity [m], the complex root of the radar cross-section, at knots spread
            evenly over the band and linear in between.
        links: Pairs of antennas, on any device.
        subcarriers: Subcarriers.
        normals: Outward unit normals; None: every Gaussian is seen from all sides.
        sharpness: How fast a Gaussian disappears behind its tangent plane; 0: never.
        visibility: Weight per Gaussian and group of links (`links.group`); None: 1.
        backend: Which twin computes it; None: the one for the device of `means`.

    Returns:
        CSI, one row per link and one column per selected subcarrier.

    Example:
        >>> import torch
        >>> link = Links(torch.tensor([[0.0, 0.0, 0.0]]), torch.tensor([[0.0, 0.0, 0.0]]))
        >>> subcarriers = Subcarriers(f0=299_792_458.0, df=0.0, count=1)
        >>> csi = scatter(
        ...     torch.tensor([[1.0, 0.0, 0.0]]), torch.tensor([[1.0, 0.0, 0.0, 0.0]]),
        ...     torch.full((1, 3), 1e-6), torch.ones(1, 1, dtype=torch.complex64),
        ...     link, subcarriers,
        ... )
        >>> round(csi.real.item() * (4 * torch.pi) ** 1.5, 4)
        1.0
    """
    _check_groups(links, visibility)
    links = on_device(links, means.device)
    return _twin(backend, means.device).scatter(
        means,
        quats,
        scales_rf,
        gamma,
        links,
        subcarriers,
        normals=normals,
        sharpness=sharpness,
        visibility=visibility,
    )


def shadow(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales: Float[Tensor, "gaussian 3"],
    alpha: Float[Tensor, "gaussian"],
    paths: EnvironmentPaths,
    *,
    backend: Backend | None = None,
) -> Complex[Tensor, "path"]:
    """Share of each environment path that passes the Gaussians.

    T = prod_i (1 - alpha_i e_i g_i): g is the Fresnel integral of a Gaussian blob across the
    path (`rfgs_core.propagation.fresnel`), e is 1 where the blob stands beside the leg and
    fades to 0 within `EDGE_M` of the leg's ends. Evaluated at one wavelength. Differentiable in
    all tensors but the paths.

    Args:
        means: Centres [m].
        quats: Orientations, w first, need not be normalised.
        scales: Standard deviations of the opaque shape [m], positive; not the reflecting one.
        alpha: Opacities, from 0 up to but not including 1.
        paths: Environment paths, on any device; only their legs matter here.
        backend: Which twin computes it; None: the one for the device of `means`.

    Returns:
        One complex factor per path, 1 where nothing stands in the way.
    """
    paths = on_device(paths, means.device)
    return _twin(backend, means.device).shadow(means, quats, scales, alpha, paths)


def environment(
    transmission: Complex[Tensor, "path"],
    paths: EnvironmentPaths,
    subcarriers: Subcarriers,
    num_links: int,
) -> Complex[Tensor, "link subcarrier"]:
    """CSI of the environment's paths, the first sum of the module's formula.

    Args:
        transmission: Factor T of each path.
        paths: Environment paths.
        subcarriers: Subcarriers.
        num_links: Rows of the result.
    """
    device = transmission.device
    paths = on_device(paths, device)
    turns = paths.delay_s.to(torch.float64)[:, None] * subcarriers.freq_hz.to(device)
    phase = (-2 * math.pi) * (turns - turns.detach().round())
    phasors = torch.polar(torch.ones_like(phase), phase).to(transmission.dtype)
    terms = (transmission * paths.amplitude.to(transmission.dtype))[:, None] * phasors
    total = torch.zeros(num_links, subcarriers.num_selected, dtype=terms.dtype, device=device)
    return total.index_add(0, paths.link, terms)


@dataclass(frozen=True)
class RadioGaussians:
    """Everything of the Gaussians that the radio sees, one row each."""

    means: Float[Tensor, "gaussian 3"]
    """Centres [m]."""
    quats: Float[Tensor, "gaussian 4"]
    """Orientations, w first, need not be normalised."""
    scales: Float[Tensor, "gaussian 3"]
    """Standard deviations of the opaque shape [m]."""
    scales_rf: Float[Tensor, "gaussian 3"]
    """Standard deviations of the reflecting cloud [m]."""
    gamma: Complex[Tensor, "gaussian knot"]
    """Reflectivity at knots over the band [m]."""
    alpha: Float[Tensor, "gaussian"]
    """Opacities, below 1."""
    normals: Float[Tensor, "gaussian 3"] | None = None
    """Outward unit normals."""
    sharpness: float = 0.0
    """How fast a Gaussian disappears behind its tangent plane."""
    visibility: Float[Tensor, "gaussian group"] | None = None
    """Weight per group of links."""


def propagate(
    gaussians: RadioGaussians,
    links: Links,
    subcarriers: Subcarriers,
    paths: EnvironmentPaths | None = None,
    *,
    backend: Backend | None = None,
) -> Complex[Tensor, "link subcarrier"]:
    """CSI of Gaussians within an environment: both sums of the module's formula.

    Args:
        gaussians: Gaussians as the radio sees them.
        links: Pairs of antennas.
        subcarriers: Subcarriers.
        paths: Paths of the empty scene; None: only what the Gaussians scatter.
        backend: Which twin computes it; None: the one for the device of `means`.
    """
    g = gaussians
    total = scatter(
        g.means,
        g.quats,
        g.scales_rf,
        g.gamma,
        links,
        subcarriers,
        normals=g.normals,
        sharpness=g.sharpness,
        visibility=g.visibility,
        backend=backend,
    )
    if paths is None:
        return total
    transmission = shadow(g.means, g.quats, g.scales, g.alpha, paths, backend=backend)
    return total + environment(transmission, paths, subcarriers, len(links))


def _twin(backend: Backend | None, device: torch.device) -> ModuleType:
    """The module that implements a backend."""
    if backend is None:
        backend = "numba" if device.type == "cpu" else "triton"
    if backend not in get_args(Backend):
        raise ValueError(f"expected backend to be one of {get_args(Backend)}, got {backend!r}")
    # numba and triton take a second to import: only for those who use them.
    return importlib.import_module(f"rfgs_core.propagation.{_MODULES[backend]}")


def _check_groups(links: Links, visibility: Float[Tensor, "gaussian group"] | None) -> None:
    """Refuses groups that compiled code would read past the end of `visibility`."""
    if visibility is None or links.group is None or len(links) == 0:
        return
    low, high = int(links.group.min()), int(links.group.max())
    if low < 0 or high >= visibility.shape[1]:
        raise ValueError(
            f"expected groups within 0..{visibility.shape[1] - 1}, the columns of visibility, "
            f"got {low}..{high}"
        )
