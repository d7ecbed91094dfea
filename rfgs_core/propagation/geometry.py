# SPDX-License-Identifier: Apache-2.0
"""What the propagation model is evaluated on: links, subcarriers and environment paths."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import torch
from jaxtyping import Complex, Float, Float64, Int64
from torch import Tensor


@dataclass(frozen=True)
class Links:
    """Pairs of one transmitting and one receiving antenna element."""

    tx_xyz: Float[Tensor, "link 3"]
    """Transmitting element of each link [m]."""
    rx_xyz: Float[Tensor, "link 3"]
    """Receiving element of each link [m]."""
    group: Int64[Tensor, "link"] | None = None
    """Column of `visibility` that each link uses, e.g. its device pair; None means column 0."""

    def __post_init__(self) -> None:
        if self.tx_xyz.ndim != 2 or self.tx_xyz.shape[1] != 3:
            raise ValueError(f"expected tx_xyz of shape [link, 3], got {tuple(self.tx_xyz.shape)}")
        if self.rx_xyz.shape != self.tx_xyz.shape:
            raise ValueError(
                f"expected rx_xyz of shape {tuple(self.tx_xyz.shape)} like tx_xyz, "
                f"got {tuple(self.rx_xyz.shape)}"
            )
        if self.group is not None and self.group.shape != self.tx_xyz.shape[:1]:
            raise ValueError(
                f"expected one group per link ({len(self)}), got {tuple(self.group.shape)}"
            )

    def __len__(self) -> int:
        return self.tx_xyz.shape[0]


@dataclass(frozen=True)
class Subcarriers:
    """A uniform grid of subcarriers, or contiguous blocks of one."""

    f0: float
    """Frequency of subcarrier 0 [Hz]."""
    df: float
    """Distance between subcarriers [Hz]."""
    count: int
    """Subcarriers of the whole grid; the knots of gamma are spread over all of them."""
    blocks: tuple[tuple[int, int], ...] | None = None
    """Subcarriers to evaluate as (start, count) pairs, in the order of the output; None: all."""

    def __post_init__(self) -> None:
        if self.f0 <= 0 or self.df < 0 or self.count < 1:
            raise ValueError(
                f"expected f0 > 0, df >= 0 and count >= 1, got {self.f0}, {self.df}, {self.count}"
            )
        for start, count in self.spans:
            if start < 0 or count < 1 or start + count > self.count:
                raise ValueError(
                    f"expected subcarrier blocks within 0..{self.count - 1}, "
                    f"got {count} subcarriers from {start}"
                )

    @property
    def spans(self) -> tuple[tuple[int, int], ...]:
        """Blocks to evaluate, as (start, count) pairs."""
        return ((0, self.count),) if self.blocks is None else self.blocks

    @property
    def num_selected(self) -> int:
        """Subcarriers of the output."""
        return sum(count for _, count in self.spans)

    @property
    def indices(self) -> Int64[Tensor, "subcarrier"]:
        """Index on the whole grid of each subcarrier of the output."""
        return torch.cat([torch.arange(start, start + count) for start, count in self.spans])

    @property
    def freq_hz(self) -> Float64[Tensor, "subcarrier"]:
        """Frequency of each subcarrier of the output [Hz]."""
        return self.f0 + self.df * self.indices.to(torch.float64)


@dataclass(frozen=True)
class EnvironmentPaths:
    """Propagation paths of the empty scene, unfolded along reflections, one row per path.

    A path belongs to one link. The straight leg on which a person may stand runs from `a_xyz`
    to `b_xyz`; the rest of the unfolded path lies before (`extra_a_m`) and behind it.
    """

    link: Int64[Tensor, "path"]
    """Link that each path belongs to."""
    amplitude: Complex[Tensor, "path"]
    """Complex amplitude a of each path, without the delay's phase."""
    delay_s: Float[Tensor, "path"]
    """Absolute delay of each path [s]."""
    a_xyz: Float[Tensor, "path 3"]
    """Start of the leg that people may block [m]."""
    b_xyz: Float[Tensor, "path 3"]
    """End of that leg [m]."""
    extra_a_m: Float[Tensor, "path"]
    """Length of the unfolded path before `a_xyz` [m]."""
    extra_b_m: Float[Tensor, "path"]
    """Length of the unfolded path behind `b_xyz` [m]."""
    wavelength_m: float
    """Wavelength at which the shadow is evaluated, usually of the centre frequency [m]."""

    def __post_init__(self) -> None:
        if self.a_xyz.shape != (len(self), 3) or self.b_xyz.shape != (len(self), 3):
            raise ValueError(
                f"expected leg ends of shape [{len(self)}, 3] for {len(self)} paths, got "
                f"{tuple(self.a_xyz.shape)} and {tuple(self.b_xyz.shape)}"
            )
        for name in ("amplitude", "delay_s", "extra_a_m", "extra_b_m"):
            if getattr(self, name).shape != (len(self),):
                raise ValueError(
                    f"expected {name} of shape [{len(self)}], got "
                    f"{tuple(getattr(self, name).shape)}"
                )

    def __len__(self) -> int:
        return self.link.shape[0]

    def rows(self, chosen: slice | Tensor) -> EnvironmentPaths:
        """Some of the paths; `link` keeps its meaning."""
        named = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{k: x[chosen] for k, x in named.items() if isinstance(x, Tensor)})
