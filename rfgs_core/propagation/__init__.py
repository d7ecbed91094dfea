# SPDX-License-Identifier: Apache-2.0
"""CSI of radio Gaussians: scattering, and shadows on the paths of the empty scene.

    H(f) = sum_p T_p a_p e^(-j 2 pi f tau_p)
         + sum_i gamma_i(f) v_i lambda / ((4 pi)^(3/2) d_t d_r)
           exp(-k^2 q^T Sigma_i q / 2) e^(-j k (d_t + d_r)),   q = u_t + u_r,

k = 2 pi f / c, u the unit vectors from a Gaussian to the two antennas. The Gaussian factor is
the Fourier transform of a Gaussian cloud of scatterers, so a flat one reflects like a mirror.

Every function exists twice: compiled for the CPU (`backend="numba"`, the default) and in plain
torch (`backend="torch"`), which is the definition that tests compare the former with.
"""

from __future__ import annotations

from typing import Literal

from jaxtyping import Complex, Float
from torch import Tensor

from rfgs_core.propagation.geometry import EnvironmentPaths, Links, Tones

__all__ = ["EnvironmentPaths", "Links", "Tones", "scatter"]

Backend = Literal["numba", "torch"]


def scatter(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales_rf: Float[Tensor, "gaussian 3"],
    gamma: Complex[Tensor, "gaussian knot"],
    links: Links,
    tones: Tones,
    normals: Float[Tensor, "gaussian 3"] | None = None,
    sharpness: float = 0.0,
    visibility: Float[Tensor, "gaussian group"] | None = None,
    *,
    backend: Backend = "numba",
) -> Complex[Tensor, "link subcarrier"]:
    """CSI that Gaussians scatter, the second sum of the module's formula.

    Differentiable in all tensors but the links. The precision is that of `scales_rf`; distances
    are always double. v = visibility * sigmoid(sharpness n.u_t) * sigmoid(sharpness n.u_r).

    Args:
        means: Centres [m].
        quats: Orientations, w first, need not be normalised.
        scales_rf: Standard deviations of the reflecting cloud [m], positive.
        gamma: Reflectivity [m] at knots spread evenly over the band, linear in between; its
            square times 1 over one square metre is the radar cross-section of a point.
        links: Pairs of antennas.
        tones: Subcarriers.
        normals: Outward unit normals; None: every Gaussian is seen from all sides.
        sharpness: How fast a Gaussian disappears behind its tangent plane; 0: never.
        visibility: Weight per Gaussian and group of links (`links.group`); None: 1.
        backend: Which twin computes it.

    Returns:
        CSI, one row per link and one column per selected tone.

    Example:
        >>> import torch
        >>> link = Links(torch.tensor([[0.0, 0.0, 0.0]]), torch.tensor([[0.0, 0.0, 0.0]]))
        >>> tones = Tones(f0=299_792_458.0, df=0.0, count=1)
        >>> csi = scatter(
        ...     torch.tensor([[1.0, 0.0, 0.0]]), torch.tensor([[1.0, 0.0, 0.0, 0.0]]),
        ...     torch.full((1, 3), 1e-6), torch.ones(1, 1, dtype=torch.complex64), link, tones,
        ... )
        >>> round(csi.real.item() * (4 * torch.pi) ** 1.5, 4)
        1.0
    """
    _check_groups(links, visibility)
    if backend == "torch":
        from rfgs_core.propagation import reference as twin
    else:
        # numba takes a second to import: only for those who use it.
        from rfgs_core.propagation import fast as twin
    return twin.scatter(
        *(means, quats, scales_rf, gamma, links, tones, normals, sharpness, visibility)
    )


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
