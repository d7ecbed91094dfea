# SPDX-License-Identifier: Apache-2.0
"""Beam–range maps of many moments at once, for a GPU: `heard.body_echoes` as products of matrices.

The sum over facets of a way is a product of two matrices: what arrays make of each facet in each
beam, which is real, and each facet's wave in each range. Phases are in single precision, which
takes 2e-3 rad of a path of 20 m at 62 GHz.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Float, Int64
from torch import Tensor

from rfgs_core.articulated import people
from rfgs_core.articulated.bones import BONES
from rfgs_core.encode.body_maps import AZIMUTHS, ELEVATIONS, Ranges
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.surface.points import LIFT_M
from rfgs_core.worlds.batch import Batch
from rfgs_core.worlds.echoes import (
    ASLANT,
    FORWARD,
    LOBES_OF_GAP,
    MOST_DAMPED,
    PER_CELL,
    PER_COSINE,
    TABLE,
    WIDEST,
)
from rfgs_core.worlds.figure import BEHIND_M, CELLS, Figure, look_cell
from rfgs_core.worlds.heard import EVERY, LATEST_M, skin_reflection

#: Facets of all ways that are summed at once: some 1 kB each.
_AT_ONCE = 2**21


class _Facets(NamedTuple):
    """A body in every moment."""

    points: Float[Tensor, "moment facet 3"]
    normals: Float[Tensor, "moment facet 3"]
    areas: Float[Tensor, "facet"]
    cell_m: float
    """Width of a cell of `figure.seen_among` [m]."""

    def thinned(self) -> _Facets:
        """Every few of them."""
        points, normals = (values[..., ::EVERY, :].contiguous() for values in self[:2])
        cell_m = self.cell_m * math.sqrt(len(self.areas) / points.shape[1])
        return _Facets(points, normals, self.areas[::EVERY], cell_m)


class _Ways(NamedTuple):
    """Ways from a transmitter by a body to a receiver, one of which may stand behind a wall."""

    moment: Int64[Tensor, "way"]
    pair: Int64[Tensor, "way"]
    """Device pair, as in `Batch.pairs`."""
    ends: Float[Tensor, "way 2 3 3"]
    """As `Batch.ends`, mirrored where a wall is in the way."""
    table: Int64[Tensor, "way 2 2"]
    cosines: Float[Tensor, "way 2 2"]
    """Direction cosines of the centre at the pair itself."""
    first_m: Float[Tensor, "way"]
    """Path of the first range [m]."""
    gain: Float[Tensor, "way"]
    """Amplitude at the wall, times 4π d_t d_r of the centre."""
    sees: tuple[Bool[Tensor, "way facet"], Bool[Tensor, "way facet"]]
    """What the ends see."""

    def some(self, rows: slice | Tensor) -> _Ways:
        """Some of them."""
        return _Ways(
            self.moment[rows], self.pair[rows], self.ends[rows], self.table[rows],
            self.cosines[rows], self.first_m[rows], self.gain[rows],
            (self.sees[0][rows], self.sees[1][rows]),
        )  # fmt: skip


class BatchedEchoes:
    """Hears batches of moments of one radio on one device."""

    def __init__(
        self, radio: Radio, device: str | torch.device, kernels: bool | None = None
    ) -> None:
        """Prepares what does not depend on the moment.

        Args:
            radio: The radio.
            device: Where batches are.
            kernels: Whether facets go through `kernels_triton`; None: on a GPU.
        """
        wavelength_m = SPEED_OF_LIGHT / float(radio.freq_hz.max())
        figure = Figure.of(people().body(np.zeros(0)), wavelength_m)
        shares = np.zeros((len(figure.points), len(BONES)), "f4")
        np.put_along_axis(shares, figure.bone, figure.weight, axis=1)
        self.device = torch.device(device)
        self._kernels = self.device.type == "cuda" if kernels is None else kernels
        self._shares = torch.from_numpy(shares).to(self.device)
        self._wavenumber = 2.0 * np.pi * float(radio.freq_hz.mean()) / SPEED_OF_LIGHT
        self._ranges = Ranges.of_band(radio.freq_hz)
        self._cell_m = SPEED_OF_LIGHT / radio.bandwidth_hz
        self._skin = skin_reflection(radio.centre_hz)
        self._beams = [
            torch.tensor(values, dtype=torch.float32, device=self.device)
            for values in (ELEVATIONS, AZIMUTHS)
        ]

    def maps(self, batch: Batch) -> Float[Tensor, "moment pair elevation azimuth range"]:
        """Power that each device pair hears, as `heard.body_echoes` [m⁴]; 0 of padding.

        Args:
            batch: Moments, as tensors on this device.
        """
        facets = self._posed(batch)
        direct = _see(facets, batch.ends[:, :, :, 0].mean(2))
        direct &= facets.points[:, None, :, 2] > batch.above_m[..., None]
        shape = (*batch.there.shape, len(ELEVATIONS) * len(AZIMUTHS), self._ranges.count)
        out = torch.zeros(shape, dtype=torch.complex64, device=self.device)
        self._add(out, batch, facets, self._straight(batch, direct))
        thin = facets.thinned()
        for ways in self._by_bounces(batch, thin, direct[..., ::EVERY]):
            self._add(out, batch, thin, ways)
        return (out * self._skin).abs().square().unflatten(2, (len(ELEVATIONS), len(AZIMUTHS)))

    def _posed(self, batch: Batch) -> _Facets:
        """Facets in the world, as `Figure.posed`."""
        blend = torch.cat([batch.turns, batch.moves[..., None]], -1).flatten(2)
        own = (self._shares @ blend).unflatten(-1, (3, 4))
        points = (own[..., :3] @ batch.points[:, :, None])[..., 0] + own[..., 3]
        normals = (own[..., :3] @ batch.normals[:, :, None])[..., 0]
        normals = torch.nn.functional.normalize(normals, dim=-1)
        cell_m = look_cell(len(batch.areas_m2), float(batch.areas_m2.sum()))
        return _Facets(points + LIFT_M * normals, normals, batch.areas_m2, cell_m)

    def _straight(self, batch: Batch, sees: Bool[Tensor, "moment device facet"]) -> _Ways:
        """The ways of all pairs without a wall."""
        moment, pair = batch.there.nonzero(as_tuple=True)
        device = batch.pairs[moment, pair]
        ends = torch.stack([batch.ends[moment, device[:, side], side] for side in (0, 1)], 1)
        table = torch.stack([batch.table[moment, device[:, side], side] for side in (0, 1)], 1)
        legs = ends[:, :, 0].norm(dim=-1)
        # The centre of the maps is the origin.
        cosines = -(ends[:, :, 1:] @ ends[:, :, 0, :, None])[..., 0] / legs[..., None]
        first_m = legs.sum(1) + float(self._ranges.offsets_m[0])
        gain = 4.0 * math.pi * legs.prod(1)
        lit = (sees[moment, device[:, 0]], sees[moment, device[:, 1]])
        return _Ways(moment, pair, ends, table, cosines, first_m, gain, lit)

    def _by_bounces(
        self, batch: Batch, facets: _Facets, sees: Bool[Tensor, "moment device facet"]
    ) -> list[_Ways]:
        """The ways of all pairs with their transmitter, or receiver, behind one wall."""
        straight = self._straight(batch, sees)
        images = _images(batch)
        seen = _see(facets, images[..., 0, :].mean(3).flatten(1, 2)).unflatten(1, (6, -1))
        straight_m = straight.ends[:, :, 0].norm(dim=-1).sum(1)
        gains = batch.reflects.flatten(1)[straight.moment]
        out = []
        for end in (0, 1):
            device = batch.pairs[straight.moment, straight.pair, end]
            ends = straight.ends[:, None].repeat(1, 6, 1, 1, 1)
            ends[:, :, end] = images[straight.moment, :, device, end]
            later_m = ends[..., 0, :].norm(dim=-1).sum(2) - straight_m[:, None]
            way, wall = ((gains > 0.0) & (later_m <= LATEST_M)).nonzero(as_tuple=True)
            ways = straight.some(way)
            lit = list(ways.sees)
            lit[end] = seen[ways.moment, wall, device[way]]
            gain = ways.gain * gains[way, wall] * math.sqrt(EVERY)
            out.append(ways._replace(ends=ends[way, wall], gain=gain, sees=(lit[0], lit[1])))
        return out

    def _add(
        self,
        out: Complex64[Tensor, "moment pair beam range"],
        batch: Batch,
        facets: _Facets,
        ways: _Ways,
    ) -> None:
        """Adds what comes along some ways."""
        at_once = max(_AT_ONCE // len(facets.areas), 1)
        for first in range(0, len(ways.moment), at_once):
            some = ways.some(slice(first, first + at_once))
            out.index_put_((some.moment, some.pair), self._sum(batch, facets, some), True)

    def _sum(
        self, batch: Batch, facets: _Facets, ways: _Ways
    ) -> Complex64[Tensor, "way beam range"]:
        """What each of some ways hears; see `echoes._add_echo`."""
        if self._kernels:
            return self._sum_by_kernel(batch, facets, ways)
        points, normals = facets.points[ways.moment], facets.normals[ways.moment]
        legs = points[:, None] - ways.ends[:, :, None, 0]
        length = legs.norm(dim=-1)
        units = legs / length[..., None]
        amplitude = self._amplitude(units, normals, facets.areas, ways)
        amplitude = amplitude * (ways.gain[:, None] / (4.0 * math.pi)) * facets.areas
        path = length.sum(1)
        wave = torch.polar(amplitude / length.prod(1), -self._wavenumber * path)
        window = self._window(batch, ways, path) * wave[..., None]
        # Direction cosines at either end along either axis, less those of the centre.
        off = (units @ ways.ends[:, :, 1:].mT) - ways.cosines[:, :, None]
        across, up = (self._beam(batch, ways, off, axis) for axis in (0, 1))
        beams = (up[..., :, None] * across[..., None, :]).flatten(2)
        heard = beams.mT @ torch.view_as_real(window).flatten(2)
        return torch.view_as_complex(heard.unflatten(-1, (-1, 2)))

    def _sum_by_kernel(
        self, batch: Batch, facets: _Facets, ways: _Ways
    ) -> Complex64[Tensor, "way beam range"]:
        """The same, its factors written by one kernel."""
        from rfgs_core.worlds.kernels_triton import ACROSS, BLOCK, UP, facet_waves

        count, total, ranges = len(ways.moment), len(facets.areas), self._ranges.count
        flat = [ways.ends.flatten(1), ways.cosines.flatten(1), ways.first_m[:, None]]
        numbers = torch.cat([*flat, ways.gain[:, None]], 1).contiguous()
        response = (batch.band[ways.moment] * batch.responses.shape[1])[:, None]
        rows = [ways.moment[:, None], ways.table.flatten(1) * TABLE, response]
        lit = ways.sees[0].to(torch.uint8) + 2 * ways.sees[1].to(torch.uint8)
        beams = numbers.new_empty(count, UP * ACROSS, total)
        waves = numbers.new_empty(count, 2 * ranges, total)
        sizes: dict[str, Any] = {"BLOCK": BLOCK}
        if count == 0:
            return torch.zeros(0, UP * ACROSS, ranges, dtype=torch.complex64, device=self.device)
        facet_waves[(-(-total // BLOCK), count)](
            facets.points.contiguous(), facets.normals.contiguous(), facets.areas.contiguous(),
            lit, numbers, torch.cat(rows, 1).contiguous(), batch.tables.contiguous(),
            torch.view_as_real(batch.responses).contiguous(), beams, waves,
            total, ranges, batch.responses.shape[1] - 1, self._wavenumber / (2.0 * math.pi),
            self._wavenumber**2 / 24.0, 1.0 / self._skin, 1.0 / self._ranges.step_m,
            self._ranges.step_m / self._cell_m * PER_CELL, **sizes,
        )  # fmt: skip
        heard = beams @ waves.mT
        return torch.complex(heard[..., :ranges], heard[..., ranges:])

    def _amplitude(
        self,
        units: Float[Tensor, "way 2 facet 3"],
        normals: Float[Tensor, "way facet 3"],
        areas: Float[Tensor, "facet"],
        ways: _Ways,
    ) -> Float[Tensor, "way facet"]:
        """What facets send on, over A/(4π d_t d_r); see `echoes._amplitude`."""
        c_i, c_s = (-(units * normals[:, None]).sum(-1)).unbind(1)
        # The way out runs from the facet to the receiver.
        forward = -(units[:, 0] * units[:, 1]).sum(-1)
        q_n = c_i + c_s
        damped = self._wavenumber**2 / 24.0 * areas * (2.0 - 2.0 * forward - q_n * q_n).clamp_min(0)
        echo = torch.where(ways.sees[1] & (c_s > 0.0), 0.5 * q_n, 0.0)
        shadow = ((forward - ASLANT) / (FORWARD - ASLANT)).clamp(0.0, 1.0) / self._skin * c_i
        lit = ways.sees[0] & (c_i > 0.0) & (damped <= MOST_DAMPED)
        return torch.where(lit, (echo + shadow) * torch.exp(-damped), 0.0)

    def _beam(
        self, batch: Batch, ways: _Ways, off: Float[Tensor, "way 2 facet 2"], axis: int
    ) -> Float[Tensor, "way facet beam"]:
        """What both arrays of a way make of each facet in the beams along an axis."""
        beams = self._beams[1 - axis]
        at = ((off[..., axis, None] - beams + WIDEST) * PER_COSINE).clamp(0.0, TABLE - 1.001)
        low = at.long()
        row = ways.table[:, :, axis, None, None] * TABLE
        flat = batch.tables.flatten()
        lower = flat[row + low]
        return (lower + (at - low) * (flat[row + low + 1] - lower)).prod(1)

    def _window(
        self, batch: Batch, ways: _Ways, path: Float[Tensor, "way facet"]
    ) -> Complex64[Tensor, "way facet range"]:
        """What the band makes of each facet's path in every range."""
        step, size = self._ranges.step_m, batch.responses.shape[1]
        at = (path - ways.first_m[:, None]) / step
        ranges = torch.arange(self._ranges.count, device=self.device)
        x = (ranges - at[..., None]) * (step / self._cell_m * PER_CELL) + LOBES_OF_GAP * PER_CELL
        near = (x >= 0.0) & (x <= size - 1)
        x = x.clamp(0.0, size - 1.001)
        low = x.long()
        row = batch.band[ways.moment][:, None, None] * size
        flat = torch.view_as_real(batch.responses).flatten(0, 1)
        lower = flat[row + low]
        value = lower + (x - low)[..., None] * (flat[row + low + 1] - lower)
        return torch.view_as_complex(value * near[..., None])


def _images(batch: Batch) -> Float[Tensor, "moment 6 device 2 3 3"]:
    """Images of all ends in the six sides of the room, as `echoes.mirrored`."""
    across = torch.eye(3, device=batch.ends.device).repeat_interleave(2, 0)
    out = batch.ends[:, None] * (1.0 - 2.0 * across)[:, None, None, None]
    shift = 2.0 * batch.walls_m.flatten(1)[..., None] * across
    out[..., 0, :] += shift[:, :, None, None]
    return out


def _see(
    facets: _Facets, places: Float[Tensor, "moment place 3"]
) -> Bool[Tensor, "moment place facet"]:
    """Facets that each place [m] sees, as `figure.seen_among`."""
    way = facets.points[:, None] - places[:, :, None]
    middle = facets.points.mean(1, keepdim=True) - places
    away = way.norm(dim=-1)
    cell = facets.cell_m / middle.norm(dim=-1, keepdim=True)
    turn = (
        torch.atan2(way[..., 1], way[..., 0])
        - torch.atan2(middle[..., 1], middle[..., 0])[..., None]
    )
    turn = turn - 2.0 * math.pi * torch.round(turn / (2.0 * math.pi))
    rise = torch.atan2(way[..., 2], way[..., :2].norm(dim=-1))
    level = torch.atan2(middle[..., 2], middle[..., :2].norm(dim=-1))[..., None]
    column = (turn / cell + 0.5 * CELLS).long().clamp(0, CELLS - 1)
    row = ((rise - level) / cell + 0.5 * CELLS).long().clamp(0, CELLS - 1)
    faces = (way * facets.normals[:, None]).sum(-1) < 0.0
    index = row * CELLS + column
    nearest = torch.full((*index.shape[:2], CELLS * CELLS), torch.inf, device=way.device)
    nearest.scatter_reduce_(2, index, torch.where(faces, away, torch.inf), "amin")
    return faces & (away <= nearest.gather(2, index) + BEHIND_M)
