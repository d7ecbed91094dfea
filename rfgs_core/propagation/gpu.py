# SPDX-License-Identifier: Apache-2.0
"""The propagation model on a GPU, differentiable in torch.

Scattering and shadows go through kernels of our own. Results are single.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import torch
from jaxtyping import Complex, Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from rfgs_core.propagation import reference
from rfgs_core.propagation.covariance import covariances_by_products
from rfgs_core.propagation.fresnel import leg_frames
from rfgs_core.propagation.geometry import EnvironmentPaths, Links, Subcarriers
from rfgs_core.propagation.kernels_triton import (
    BY_GAIN,
    BY_GROUP,
    BY_MEANS,
    BY_NORMALS,
    BY_SHAPE,
    ROWS,
    SCATTER_SLOPES,
    SUBCARRIERS,
    scatter_backward,
    scatter_forward,
)
from rfgs_core.propagation.kernels_triton_shadow import (
    BY_ALPHA,
    GRADIENTS,
    LEGS,
    SCREENS,
    SLOPES,
    shadow_backward,
    shadow_forward,
)
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: Programs that keep a large GPU busy; fewer links or Gaussians are split further.
PROGRAMS = 2048
#: Splits never go below this many Gaussians or links.
LEAST_GAUSSIANS, LEAST_LINKS = 8 * ROWS, 8


@functools.lru_cache(maxsize=32)
def _knots(
    subcarriers: Subcarriers, knots: int, device: torch.device
) -> list[tuple[Tensor, _Chunks]]:
    """Share of each knot in every subcarrier, and the subcarriers where it has one.

    The same in every step of a fit, and copies to a device make it wait.
    """
    rows = []
    for knot in range(knots):
        one = torch.eye(knots, dtype=torch.float64)[[knot]]
        share = reference.gamma_at_subcarriers(one, subcarriers)[0]
        rows.append((share.to(device, torch.float32), _Chunks(subcarriers, share > 0, device)))
    return rows


class _Chunks:
    """Runs of `SUBCARRIERS` neighbouring subcarriers that hold all those marked.

    Subcarriers between them that nobody asked for are computed and dropped: where every seventh is
    hidden, that is less work than a run of its own for each six.
    """

    def __init__(self, subcarriers: Subcarriers, marked: Tensor, device: torch.device) -> None:
        columns = torch.nonzero(marked)[:, 0]
        indices = subcarriers.indices[columns]
        lowest = int(indices.min()) if len(indices) else 0
        runs, run = torch.unique((indices - lowest) // SUBCARRIERS, return_inverse=True)
        hz = subcarriers.f0 + subcarriers.df * (lowest + runs.double() * SUBCARRIERS)
        cycles = torch.stack([hz, torch.full_like(hz, subcarriers.df)], dim=1) / SPEED_OF_LIGHT
        slots = run * SUBCARRIERS + (indices - lowest) % SUBCARRIERS
        self.count = len(runs)
        self.cycles_per_m = cycles.to(device)
        self._columns, self._slots = columns.to(device), slots.to(device)
        self._width = subcarriers.num_selected

    def taken(self, sums: Float[Tensor, "... slot"]) -> Float[Tensor, "... column"]:
        """What kernels have written, by column; zero where nothing is marked."""
        out = sums.new_zeros(*sums.shape[:-1], self._width)
        out[..., self._columns] = sums[..., self._slots]
        return out

    def laid(self, values: Float[Tensor, "... column"]) -> Float[Tensor, "... slot"]:
        """What kernels read; zero in slots without a subcarrier."""
        out = values.new_zeros(*values.shape[:-1], self.count * SUBCARRIERS)
        out[..., self._slots] = values[..., self._columns]
        return out


class _Scatter(torch.autograd.Function):
    """H[link, subcarrier] less its wavelengths; all tensors have the Gaussian axis last."""

    @staticmethod
    def forward(
        ctx: Any,
        means: Tensor,
        shape: Tensor,
        gain: Tensor,
        visibility: Tensor,
        normals: Tensor,
        setting: tuple[float, Tensor, Tensor, _Chunks],
    ) -> Tensor:
        """Args: as `kernels_scatter.Cloud`; no visibility or normals: rows of length 0."""
        sharpness, ends, group, chunks = setting
        cloud = (
            means.detach().double().contiguous(),
            *(x.detach().float().contiguous() for x in (shape, gain, visibility, normals)),
        )
        flags = {"FACING": normals.shape[1] > 0, "WEIGHED": visibility.shape[1] > 0}
        links, total = len(ends), means.shape[1]
        splits = _splits(links * chunks.count, total, LEAST_GAUSSIANS)
        per_split = -(-total // splits // ROWS) * ROWS
        width = chunks.count * SUBCARRIERS
        sums = means.new_zeros(splits, links, 2, width, dtype=torch.float32)
        if links and total and width:
            _launch(
                scatter_forward, (links, chunks.count, splits),
                *cloud, ends, group, chunks.cycles_per_m, sums, total, per_split, sharpness,
                **flags, ROWS=ROWS, SUBCARRIERS=SUBCARRIERS,
            )  # fmt: skip
        ctx.state = (cloud, setting, flags)
        ctx.dtypes = tuple(x.dtype for x in (means, shape, gain, visibility, normals))
        real, imaginary = chunks.taken(sums.sum(dim=0)).unbind(1)
        return torch.complex(real, imaginary)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Chains the gradient of H to everything but the setting."""
        cloud, (sharpness, ends, group, chunks), flags = ctx.state
        means, _, _, visibility, normals = cloud
        seed = torch.view_as_real(grads[0].conj().resolve_conj())
        seed = chunks.laid(seed.permute(0, 2, 1).float())
        links, total = len(ends), means.shape[1]
        rows, tiles = BY_GROUP + len(visibility), -(-total // SCATTER_SLOPES)
        splits = _splits(tiles, links, LEAST_LINKS)
        out = means.new_zeros(splits, rows, total, dtype=torch.float32)
        if links and total and chunks.count:
            _launch(
                scatter_backward, (tiles, splits),
                *cloud, ends, group, chunks.cycles_per_m, seed, out, total, links, chunks.count,
                rows, -(-links // splits), sharpness,
                **flags, SLOPES=SCATTER_SLOPES, SUBCARRIERS=SUBCARRIERS,
            )  # fmt: skip
        summed = out.sum(dim=0)
        result = (
            summed[BY_MEANS:BY_SHAPE],
            summed[BY_SHAPE:BY_GAIN],
            summed[BY_GAIN:BY_NORMALS],
            summed[BY_GROUP:] if flags["WEIGHED"] else visibility,
            summed[BY_NORMALS:BY_GROUP] if flags["FACING"] else normals,
        )
        return (*(x.to(dtype) for x, dtype in zip(result, ctx.dtypes, strict=True)), None)


def _launch(kernel: Any, grid: tuple[int, ...], *arguments: Any, **sizes: Any) -> None:
    """Runs a kernel: one program per place of the grid."""
    kernel[grid](*arguments, **sizes)


def _splits(programs: int, count: int, least: int) -> int:
    """Into how many parts a sum of `count` terms is cut so that the device has enough to do."""
    return max(1, min(-(-PROGRAMS // max(programs, 1)), count // least))


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
    """Twin of `rfgs_core.propagation.scatter` on the device of `means`, in single precision."""
    device, knots = means.device, gamma.shape[1]
    shape = covariances_by_products(quats, scales_rf)
    group = links.group
    if visibility is None:
        visibility, group = means.new_zeros(0, 1), None
    if group is None:
        group = torch.zeros(len(links), dtype=torch.int64, device=device)
    group = group.to(torch.int64).contiguous()
    if normals is None or sharpness == 0.0:
        normals = means.new_zeros(0, 3)
    ends = torch.cat([links.tx_xyz, links.rx_xyz], dim=1).double().contiguous()
    total = means.new_zeros(len(links), subcarriers.num_selected, dtype=torch.complex64)
    for knot, (share, chunks) in enumerate(_knots(subcarriers, knots, device)):
        setting = (sharpness, ends, group, chunks)
        gain = torch.stack([gamma[:, knot].real, gamma[:, knot].imag])
        part = _Scatter.apply(means.T, shape, gain, visibility.T, normals.T, setting)
        total = total + part * share
    wavelength_m = (SPEED_OF_LIGHT / subcarriers.freq_hz).to(device, torch.float32)
    return (total * (wavelength_m / (4 * math.pi) ** 1.5)).to(gamma.dtype)


class _Shadow(torch.autograd.Function):
    """T[path] of packed Gaussians; all tensors have the Gaussian axis last."""

    @staticmethod
    def forward(ctx: Any, means: Tensor, shape: Tensor, alpha: Tensor, legs: Tensor) -> Tensor:
        """Args: as `kernels_shadow.Screens`; legs as `kernels_triton_shadow` reads them."""
        screens = (
            means.detach().double().contiguous(),
            shape.detach().double().contiguous(),
            alpha.detach().float().contiguous(),
        )
        count, total = len(legs), means.shape[1]
        splits = _splits(-(-count // LEGS), total, LEAST_GAUSSIANS)
        per_split = -(-total // splits // SCREENS) * SCREENS
        factors = means.new_ones(splits, 2, count, SCREENS, dtype=torch.float32)
        if count and total:
            _launch(
                shadow_forward, (-(-count // LEGS), splits),
                *screens, legs, factors, total, count, per_split, LEGS=LEGS, SCREENS=SCREENS,
            )  # fmt: skip
        else:
            factors[:, 1] = 0.0
        real, imaginary = factors.double().unbind(1)
        product = torch.complex(real, imaginary).prod(dim=2).prod(dim=0)
        ctx.state = (screens, legs, product)
        ctx.dtypes = (means.dtype, shape.dtype, alpha.dtype)
        return product.to(alpha.dtype.to_complex())

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Chains the gradient of T to means, shape and alpha."""
        screens, legs, product = ctx.state
        seed = torch.view_as_real((grads[0].conj() * product).resolve_conj()).float().contiguous()
        count, total = len(legs), screens[0].shape[1]
        tiles = -(-total // SLOPES)
        splits = _splits(tiles, count, LEAST_LINKS)
        out = seed.new_zeros(splits, GRADIENTS, total)
        if count and total:
            _launch(
                shadow_backward, (tiles, splits),
                *screens, legs, seed, out, total, count, -(-count // splits),
                SLOPES=SLOPES, GRADIENTS=GRADIENTS,
            )  # fmt: skip
        summed = out.sum(dim=0)
        result = summed[:BY_SHAPE], summed[BY_SHAPE:BY_ALPHA], summed[BY_ALPHA]
        return (*(x.to(dtype) for x, dtype in zip(result, ctx.dtypes, strict=True)), None)


def shadow(
    means: Float[Tensor, "gaussian 3"],
    quats: Float[Tensor, "gaussian 4"],
    scales: Float[Tensor, "gaussian 3"],
    alpha: Float[Tensor, "gaussian"],
    paths: EnvironmentPaths,
) -> Complex[Tensor, "path"]:
    """Twin of `rfgs_core.propagation.shadow` on the device of `means`."""
    shape = covariances_by_products(quats.double(), scales.double())
    table = leg_frames(paths).table()
    unfolded_m = table[:, 12:].sum(dim=1, keepdim=True).clamp(min=1e-300)
    legs = torch.cat([table, paths.wavelength_m / (2 * math.pi * unfolded_m)], dim=1)
    legs = legs.to(means.device).contiguous()
    return _Shadow.apply(means.T, shape, alpha.to(scales.dtype), legs)
