# SPDX-License-Identifier: Apache-2.0
"""Propagation between antennas and points with exact path lengths, differentiable in the channel.

The plain twin of `back_projection.images`, for few points and with gradients.
"""

from __future__ import annotations

import torch
from jaxtyping import Complex, Complex64, Float64
from torch import Tensor

from rfgs_core.encode.learned.blocks import Blocks
from rfgs_core.radio.constants import SPEED_OF_LIGHT


def _legs(
    elements: Float64[Tensor, "element 3"],
    points: Float64[Tensor, "N 3"],
    freq_hz: Float64[Tensor, "subcarrier"],
) -> Complex64[Tensor, "element subcarrier N"]:
    """exp(+j2πf d/c); phases are reduced in double."""
    distance_m = torch.linalg.norm(elements[:, None] - points, dim=-1)
    cycles = freq_hz[:, None] * distance_m[:, None] / SPEED_OF_LIGHT
    phase = (2.0 * torch.pi * torch.frac(cycles)).float()
    return torch.polar(torch.ones_like(phase), phase)


def steering(
    blocks: Blocks, pair: int, points: Float64[Tensor, "N 3"]
) -> Complex64[Tensor, "tx rx subcarrier N"]:
    """exp(+j2πf (d_t + d_r)/c) of one device pair's antennas and subcarriers."""
    out = _legs(blocks.tx_xyz[pair], points, blocks.freq_hz)
    back = _legs(blocks.rx_xyz[pair], points, blocks.freq_hz)
    return out[:, None] * back[None]


def focus(
    weighed: Complex[Tensor, "channel tx rx subcarrier"],
    steer: Complex64[Tensor, "tx rx subcarrier N"],
    links: int,
) -> Complex[Tensor, "channel N"]:
    """What the weighed channel of a pair says coherently at points: the mean over its links."""
    entries = weighed.flatten(1) @ steer.flatten(0, 2)
    return entries / (links * weighed.shape[-1])


def radiate(
    sources: Complex[Tensor, "N"], steer: Complex64[Tensor, "tx rx subcarrier N"]
) -> Complex[Tensor, "tx rx subcarrier"]:
    """Channel of a pair caused by scatterers at the points."""
    return torch.conj(steer) @ sources
