# SPDX-License-Identifier: Apache-2.0
"""The propagation model in plain torch: readable, differentiable in any precision, slow.

Every function has the same arguments and result as its fast twin in `fast`.
"""

from __future__ import annotations

import math

import torch
from jaxtyping import Complex, Float, Float64
from torch import Tensor

from rfgs_core.propagation.covariance import covariances
from rfgs_core.propagation.geometry import Links, Tones
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Elements of the largest intermediate array [gaussian, link, subcarrier].
MAX_ELEMENTS = 1 << 21


def gamma_at_tones(
    gamma: Complex[Tensor, "gaussian knot"], tones: Tones
) -> Complex[Tensor, "gaussian subcarrier"]:
    """Interpolates gamma linearly between knots spread evenly over the whole band."""
    knots = gamma.shape[1]
    if knots == 1:
        return gamma.expand(-1, tones.num_selected)
    position = tones.indices.to(gamma.real.dtype) * ((knots - 1) / max(tones.count - 1, 1))
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
    tones: Tones,
    normals: Float[Tensor, "gaussian 3"] | None = None,
    sharpness: float = 0.0,
    visibility: Float[Tensor, "gaussian group"] | None = None,
) -> Complex[Tensor, "link subcarrier"]:
    """Twin of `rfgs_core.propagation.scatter`: the same sum, written out."""
    total = torch.zeros(len(links), tones.num_selected, dtype=gamma.dtype)
    rows = max(1, MAX_ELEMENTS // max(1, len(links) * tones.num_selected))
    for first in range(0, means.shape[0], rows):
        part = slice(first, first + rows)
        total = total + _scatter_block(
            *(means[part], covariances(quats[part], scales_rf[part]), gamma[part], links, tones),
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
    tones: Tones,
    normals: Float[Tensor, "gaussian 3"] | None,
    sharpness: float,
    visibility: Float[Tensor, "gaussian group"] | None,
) -> Complex[Tensor, "link subcarrier"]:
    """Sum over a few Gaussians, through arrays of [gaussian, link, subcarrier]."""
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
    freq_hz = tones.freq_hz
    wavenumber = (2 * math.pi / SPEED_OF_LIGHT * freq_hz).to(real)
    turns = (distance_tx + distance_rx)[..., None] * (freq_hz / SPEED_OF_LIGHT)
    phase = (-2 * math.pi) * (turns - turns.detach().round()).to(real)
    magnitude = weight[..., None] * torch.exp(-0.5 * spread[..., None] * wavenumber**2)
    terms = torch.polar(magnitude, phase)
    summed = torch.einsum("mf,mlf->lf", gamma_at_tones(gamma, tones), terms)
    return summed * (SPEED_OF_LIGHT / freq_hz / (4 * math.pi) ** 1.5).to(real)
