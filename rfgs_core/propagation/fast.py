# SPDX-License-Identifier: Apache-2.0
"""The propagation model on the CPU through compiled kernels, differentiable in torch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from jaxtyping import Complex, Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from rfgs_core.propagation import (
    kernels_covariance,
    kernels_scatter,
    kernels_scatter_gradient,
    kernels_shadow,
)
from rfgs_core.propagation.fresnel import leg_frames
from rfgs_core.propagation.geometry import EnvironmentPaths, Links, Subcarriers
from rfgs_core.propagation.kernels_scatter import UNROLL, Cloud, Plan
from rfgs_core.propagation.kernels_scatter_gradient import CloudGradient
from rfgs_core.propagation.kernels_shadow import Screens
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Subcarriers per chunk: rounding errors of the recurrence stay below 1e-5 in float32.
CHUNK = 64


class _Chunks:
    """Subcarriers cut into chunks that cross neither a block's end nor a knot of gamma.

    In each chunk gamma is sum_j basis[piece, j, knot] gamma[knot] kappa^j, kappa being the
    offset from the chunk's centre in subcarriers.
    """

    def __init__(self, subcarriers: Subcarriers, knots: int) -> None:
        edges = [subcarriers.count * 2]
        if knots > 1:
            width = (subcarriers.count - 1) / (knots - 1)
            edges = [math.ceil(width * knot) for knot in range(1, knots - 1)] + edges
        rows, subcarrier_rows, basis, columns, offsets = [], [], [], [], []
        padded = 0
        for start, count in subcarriers.spans:
            at, end = start, start + count
            while at < end:
                stop = min(end, at + CHUNK, min(edge for edge in edges if edge > at))
                centre = 0.5 * (stop - at - 1)
                piece = 0 if knots == 1 else len(basis)
                length = -(-(stop - at) // UNROLL) * UNROLL
                rows.append((padded, length, piece))
                freq_hz = subcarriers.f0 + subcarriers.df * at
                subcarrier_rows.append(
                    (freq_hz, subcarriers.df, freq_hz + subcarriers.df * centre, centre)
                )
                if knots > 1 or not basis:
                    basis.append(_gain_basis(subcarriers, knots, at, centre))
                columns.extend(range(padded, padded + stop - at))
                offsets.extend(i - centre for i in range(stop - at))
                padded += length
                at = stop
        self.chunk = np.array(rows, dtype=np.int64)
        self.subcarrier = np.array(subcarrier_rows, dtype=np.float64)
        self.basis = torch.tensor(np.array(basis))
        self.column = torch.tensor(columns)
        orders = 1 if knots == 1 else 2
        #: kappa^order of every subcarrier of the output, [order, subcarrier].
        self.power = torch.tensor(offsets, dtype=torch.float64) ** torch.arange(orders)[:, None]
        self.padded = padded


def _gain_basis(subcarriers: Subcarriers, knots: int, at: int, centre: float) -> np.ndarray:
    """Weights [order, knot] of a chunk that starts at subcarrier `at` between two knots."""
    if knots == 1:
        return np.ones((1, 1))
    per_subcarrier = (knots - 1) / max(subcarriers.count - 1, 1)
    left = min(int(at * per_subcarrier + 1e-9), knots - 2)
    share = (at + centre) * per_subcarrier - left
    weights = np.zeros((2, knots))
    weights[:, left] = 1 - share, -per_subcarrier
    weights[:, left + 1] = share, per_subcarrier
    return weights


def _rows(tensor: Tensor, real: torch.dtype) -> np.ndarray:
    """A contiguous array of the tensor's values."""
    return tensor.detach().to(real).contiguous().numpy()


class _Covariances(torch.autograd.Function):
    """Distinct entries xx, yy, zz, xy, xz, yz of covariances, one row each."""

    @staticmethod
    def forward(ctx: Any, quats: Tensor, scales: Tensor) -> Tensor:
        """Args: see `rfgs_core.propagation.covariance.covariances`; of one precision."""
        ctx.rows = _rows(quats.T, scales.dtype), _rows(scales.T, scales.dtype)
        entries = np.zeros((6, len(scales)), dtype=ctx.rows[1].dtype)
        kernels_covariance.covariance_forward(*ctx.rows, entries)
        return torch.from_numpy(entries)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, ...]:
        """Chains the gradient of the entries to quaternions and scales."""
        (quats, scales), seed = ctx.rows, _rows(grads[0], grads[0].dtype)
        by_quats, by_scales = np.zeros_like(quats), np.zeros_like(scales)
        kernels_covariance.covariance_backward(quats, scales, seed, by_quats, by_scales)
        return torch.from_numpy(by_quats).T, torch.from_numpy(by_scales).T


def packed_covariances(
    quats: Float[Tensor, "gaussian 4"], scales: Float[Tensor, "gaussian 3"]
) -> Float[Tensor, "6 gaussian"]:
    """Twin of `covariances`: distinct entries xx, yy, zz, xy, xz, yz, one row each."""
    return _Covariances.apply(quats.to(scales.dtype), scales)


class _Scatter(torch.autograd.Function):
    """H[link, subcarrier] of packed Gaussians; all tensors have the Gaussian axis last."""

    @staticmethod
    def forward(
        ctx: Any,
        means: Tensor,
        shape: Tensor,
        gain: Tensor,
        visibility: Tensor,
        normals: Tensor,
        setting: tuple[float, Plan, _Chunks],
    ) -> Tensor:
        """Args: see `Cloud`; `gain` is real [piece, order, re/im, gaussian]."""
        sharpness, plan, chunks = setting
        real = shape.dtype
        cloud = Cloud(
            means=_rows(means, torch.float64),
            shape=_rows(shape, real),
            gain=_rows(gain, real),
            visibility=_rows(visibility, real),
            normals=_rows(normals, real),
            sharpness=sharpness,
        )
        size = (len(plan.ends), gain.shape[1], 2, chunks.padded)
        sums = np.zeros(size)
        kernels_scatter.scatter_forward(cloud, plan, sums)
        ctx.save_for_backward(means, shape, gain, visibility, normals)
        ctx.state = (cloud, plan, chunks)
        selected = torch.from_numpy(sums)[..., chunks.column]
        total = torch.einsum("lojf,of->jlf", selected, chunks.power)
        return torch.complex(total[0], total[1]).to(real.to_complex())

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Chains the gradient of H to what is asked for: the gain alone, or all but the setting."""
        (grad_output,) = grads
        cloud, plan, chunks = ctx.state
        real = torch.from_numpy(cloud.shape).dtype
        seed = torch.zeros(len(plan.ends), len(chunks.power), 2, chunks.padded, dtype=real)
        for order, power in enumerate(chunks.power):
            seed[:, order, 0, chunks.column] = (grad_output.real * power).to(real)
            seed[:, order, 1, chunks.column] = (-grad_output.imag * power).to(real)
        _, _, gain, *_ = ctx.saved_tensors
        if sum(ctx.needs_input_grad) == 1 and ctx.needs_input_grad[2]:
            by_gain = np.zeros_like(cloud.gain)
            kernels_scatter_gradient.gain_backward(cloud, plan, seed.numpy(), by_gain)
            return None, None, torch.from_numpy(by_gain).to(gain.dtype), None, None, None
        result = CloudGradient(
            *(np.zeros(field.shape, dtype=cloud.shape.dtype) for field in cloud[:5])
        )
        kernels_scatter_gradient.scatter_backward(cloud, plan, seed.numpy(), result)
        return (
            *(
                torch.from_numpy(value).to(tensor.dtype)
                for value, tensor in zip(result, ctx.saved_tensors, strict=True)
            ),
            None,
        )


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
    """Twin of `rfgs_core.propagation.scatter` on the CPU's vector units."""
    real = scales_rf.dtype
    chunks = _Chunks(subcarriers, gamma.shape[1])
    gain = torch.einsum("pok,mk->pom", chunks.basis.to(gamma.dtype), gamma)
    group = links.group
    if visibility is None:
        visibility, group = torch.ones(means.shape[0], 1, dtype=real), None
    if group is None:
        group = torch.zeros(len(links), dtype=torch.int64)
    if normals is None or sharpness == 0.0:
        normals, sharpness = torch.zeros(0, 3, dtype=real), 0.0
    ends = torch.cat([links.tx_xyz, links.rx_xyz], dim=1)
    plan = Plan(
        ends=_rows(ends, torch.float64),
        group=_rows(group, torch.int64),
        chunk=chunks.chunk,
        subcarrier=chunks.subcarrier,
    )
    total = _Scatter.apply(
        means.T,
        packed_covariances(quats, scales_rf),
        torch.stack([gain.real, gain.imag], dim=2).to(real),
        visibility.T,
        normals.T,
        (sharpness, plan, chunks),
    )
    wavelength_m = (SPEED_OF_LIGHT / subcarriers.freq_hz).to(real)
    return total * (wavelength_m / (4 * math.pi) ** 1.5)


class _Shadow(torch.autograd.Function):
    """T[path] of packed Gaussians; all tensors have the Gaussian axis last."""

    @staticmethod
    def forward(
        ctx: Any,
        means: Tensor,
        shape: Tensor,
        alpha: Tensor,
        legs: np.ndarray,
        wavelength_m: float,
    ) -> Tensor:
        """Args: see `Screens`; `legs` as `LegFrames.table` lays them out."""
        screens = Screens(
            _rows(means, torch.float64), _rows(shape, torch.float64), _rows(alpha, alpha.dtype)
        )
        product = np.zeros((len(legs), 2))
        kernels_shadow.shadow_forward(screens, legs, wavelength_m, product)
        ctx.dtypes = (means.dtype, shape.dtype, alpha.dtype)
        ctx.state = (screens, legs, wavelength_m, product)
        total = torch.from_numpy(product)
        return torch.complex(total[:, 0], total[:, 1]).to(alpha.dtype.to_complex())

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Chains the gradient of T to means, shape and alpha."""
        screens, legs, wavelength_m, product = ctx.state
        real = screens.alpha.dtype
        seed = grads[0].detach().numpy().conj() * (product[:, 0] + 1j * product[:, 1])
        result = Screens(*(np.zeros(field.shape, dtype=real) for field in screens))
        parts = np.stack([seed.real, seed.imag], axis=1).astype(real)
        kernels_shadow.shadow_backward(screens, legs, wavelength_m, parts, result)
        gradients = (
            torch.from_numpy(value).to(dtype)
            for value, dtype in zip(result, ctx.dtypes, strict=True)
        )
        return (*gradients, None, None)


def shadow(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales: Float[Tensor, "gaussian 3"],
    alpha: Float[Tensor, "gaussian"],
    paths: EnvironmentPaths,
) -> Complex[Tensor, "path"]:
    """Twin of `rfgs_core.propagation.shadow` on the CPU's vector units."""
    shape = packed_covariances(quats, scales.to(torch.float64))
    legs = leg_frames(paths).table().numpy()
    return _Shadow.apply(means.T, shape, alpha.to(scales.dtype), legs, paths.wavelength_m)
