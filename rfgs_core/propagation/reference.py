# SPDX-License-Identifier: Apache-2.0
"""The propagation model in plain torch: readable, differentiable in any precision, slow.

`scatter` and `shadow` have the same arguments and results as their fast twins in `fast`.
"""

from __future__ import annotations

import math

import torch
from jaxtyping import Complex, Float, Float64
from torch import Tensor

from rfgs_core.propagation.covariance import covariances
from rfgs_core.propagation.fresnel import EDGE_M, leg_frames
from rfgs_core.propagation.geometry import EnvironmentPaths, Links, Subcarriers
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Elements of the largest intermediate array [gaussian, link, subcarrier].
MAX_ELEMENTS = 1 << 21


def gamma_at_subcarriers(
    gamma: Complex[Tensor, "gaussian knot"], subcarriers: Subcarriers
) -> Complex[Tensor, "gaussian subcarrier"]:
    """Interpolates gamma linearly between knots spread evenly over the whole band."""
    knots = gamma.shape[1]
    if knots == 1:
        return gamma.expand(-1, subcarriers.num_selected)
    position = subcarriers.indices.to(gamma.device, gamma.real.dtype) * (
        (knots - 1) / max(subcarriers.count - 1, 1)
    )
    left = position.floor().clamp(max=knots - 2)
    share = position - left
    index = left.to(torch.int64)
    return gamma[:, index] * (1 - share) + gamma[:, index + 1] * share


def facing(
    normals: Float[Tensor, "gaussian 3"] | None,
    sharpness: float,
    to_tx: Float[Tensor, "gaussian link 3"],
    to_rx: Float[Tensor, "gaussian link 3"],
) -> Float[Tensor, "gaussian link"] | None:
    """Share of a Gaussian seen from both antennas; None where every Gaussian is."""
    if normals is None or sharpness == 0.0:
        return None
    seen_by_tx = torch.sigmoid(sharpness * torch.einsum("mc,mlc->ml", normals, to_tx))
    return seen_by_tx * torch.sigmoid(sharpness * torch.einsum("mc,mlc->ml", normals, to_rx))


def _legs(
    means: Float[Tensor, "gaussian 3"], antennas: Float[Tensor, "link 3"]
) -> tuple[Float64[Tensor, "gaussian link"], Float64[Tensor, "gaussian link 3"]]:
    """Distances [m] and unit vectors from Gaussians to antennas.

    Always in double: float32 loses 4e-3 rad of phase at 60 GHz and 50 m.
    """
    leg = antennas.to(torch.float64)[None] - means.to(torch.float64)[:, None]
    distance = torch.linalg.vector_norm(leg, dim=-1)
    return distance, leg / distance[..., None]


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
) -> Complex[Tensor, "link subcarrier"]:
    """Twin of `rfgs_core.propagation.scatter`: the same sum, written out."""
    total = gamma.new_zeros(len(links), subcarriers.num_selected)
    rows = max(1, MAX_ELEMENTS // max(1, len(links) * subcarriers.num_selected))
    # At least once: without Gaussians the result still hangs on the graph.
    for first in range(0, max(means.shape[0], 1), rows):
        part = slice(first, first + rows)
        total = total + _scatter_block(
            *(
                means[part],
                covariances(quats[part], scales_rf[part]),
                gamma[part],
                links,
                subcarriers,
            ),
            None if normals is None else normals[part],
            sharpness,
            None if visibility is None else visibility[part],
        )
    return total


def _scatter_block(
    means: Float[Tensor, "gaussian 3"],
    shape: Float[Tensor, "gaussian 3 3"],
    gamma: Complex[Tensor, "gaussian knot"],
    links: Links,
    subcarriers: Subcarriers,
    normals: Float[Tensor, "gaussian 3"] | None,
    sharpness: float,
    visibility: Float[Tensor, "gaussian group"] | None,
) -> Complex[Tensor, "link subcarrier"]:
    """Sum over a few Gaussians, through arrays of [gaussian, link, subcarrier]."""
    terms = echoes(means, shape, links, subcarriers, normals, sharpness, visibility)
    return torch.einsum("mf,mlf->lf", gamma_at_subcarriers(gamma, subcarriers), terms)


def echoes(
    means: Float[Tensor, "gaussian 3"],
    shape: Float[Tensor, "gaussian 3 3"],
    links: Links,
    subcarriers: Subcarriers,
    normals: Float[Tensor, "gaussian 3"] | None = None,
    sharpness: float = 0.0,
    visibility: Float[Tensor, "gaussian group"] | None = None,
) -> Complex[Tensor, "gaussian link subcarrier"]:
    """What each Gaussian alone would scatter with a reflectivity of one metre.

    Args:
        means: Centres [m].
        shape: Covariances of the reflecting clouds [m^2].
        links: Pairs of antennas.
        subcarriers: Subcarriers.
        normals: Outward unit normals; None: every Gaussian is seen from all sides.
        sharpness: How fast a Gaussian disappears behind its tangent plane.
        visibility: Weight per Gaussian and group of links.
    """
    real = shape.dtype
    distance_tx, to_tx = _legs(means, links.tx_xyz)
    distance_rx, to_rx = _legs(means, links.rx_xyz)
    to_tx, to_rx = to_tx.to(real), to_rx.to(real)
    weight = (1 / (distance_tx * distance_rx)).to(real)
    seen = facing(normals, sharpness, to_tx, to_rx)
    if seen is not None:
        weight = weight * seen
    if visibility is not None:
        weight = weight * (visibility[:, links.group] if links.group is not None else visibility)

    q = to_tx + to_rx
    spread = torch.einsum("mla,mab,mlb->ml", q, shape, q)
    freq_hz = subcarriers.freq_hz.to(means.device)
    wavenumber = (2 * math.pi / SPEED_OF_LIGHT * freq_hz).to(real)
    turns = (distance_tx + distance_rx)[..., None] * (freq_hz / SPEED_OF_LIGHT)
    phase = (-2 * math.pi) * (turns - turns.detach().round()).to(real)
    wavelength = (SPEED_OF_LIGHT / freq_hz / (4 * math.pi) ** 1.5).to(real)
    magnitude = weight[..., None] * torch.exp(-0.5 * spread[..., None] * wavenumber**2)
    return torch.polar(magnitude * wavelength, phase)


def _smooth_step(x: Float[Tensor, "..."]) -> Float[Tensor, "..."]:
    """0 below 0, 1 above 1, 3x^2 - 2x^3 in between."""
    x = x.clamp(0.0, 1.0)
    return x * x * (3 - 2 * x)


def blob_shadow(
    offset: Float[Tensor, "... 2"], spread: Float[Tensor, "... 2 2"], kappa: Float[Tensor, "..."]
) -> Complex[Tensor, "..."]:
    """Fresnel integral g of a Gaussian blob, see `rfgs_core.propagation.fresnel`.

    Args:
        offset: Centre rho_0 of the blob, across the path [m].
        spread: Covariance S of the blob, across the path [m^2].
        kappa: Area of the Fresnel zone over 2 pi [m^2].
    """
    xx, yy, xy = spread[..., 0, 0], spread[..., 1, 1], spread[..., 0, 1]
    x, y = offset[..., 0], offset[..., 1]
    c_xx, c_yy = torch.complex(xx, -kappa), torch.complex(yy, -kappa)
    det_c = c_xx * c_yy - xy**2
    exponent = (c_yy * x**2 - 2 * xy * x * y + c_xx * y**2) / det_c
    # Both factors of det C have arguments in (-pi/2, 0]: the principal root is the right one.
    return torch.sqrt((xx * yy - xy**2) / det_c) * torch.exp(-0.5 * exponent)


def shadow(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales: Float[Tensor, "gaussian 3"],
    alpha: Float[Tensor, "gaussian"],
    paths: EnvironmentPaths,
) -> Complex[Tensor, "path"]:
    """Twin of `rfgs_core.propagation.shadow`: the same product, written out."""
    real = scales.dtype
    frames = leg_frames(paths)
    centre = means.to(torch.float64)[None] - frames.origin[:, None]
    along = torch.einsum("pmc,pc->pm", centre, frames.along)
    across = torch.stack([frames.first, frames.second], dim=1)
    offset = torch.einsum("pmc,pac->pma", centre, across).to(real)
    across = across.to(real)
    spread = torch.einsum("pac,mcd,pbd->pmab", across, covariances(quats, scales), across)

    length = frames.length[:, None]
    inside = along.clamp(min=0.0).minimum(length)
    before, behind = frames.before[:, None] + inside, frames.behind[:, None] + length - inside
    total = (before + behind).clamp(min=1e-300)
    kappa = (paths.wavelength_m / (2 * math.pi) * before * behind / total).to(real)
    edge = _smooth_step(along / EDGE_M) * _smooth_step((length - along) / EDGE_M)
    blocked = (alpha * edge.to(real)) * blob_shadow(offset, spread, kappa)
    return torch.prod(1 - blocked, dim=1)
