# SPDX-License-Identifier: Apache-2.0
"""Many moments of one body as arrays: what a GPU needs to hear them all at once."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Complex64, Float32, Int64
from torch import Tensor

from rfgs_core.articulated.bones import BONES
from rfgs_core.encode.body_maps import ArrayEnd, distinct_places
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import band_window, hann
from rfgs_core.worlds.echoes import LOBES_OF_GAP, PER_CELL, TABLE, Band, array_table
from rfgs_core.worlds.heard import skin_reflection
from rfgs_core.worlds.moments import Acted, Moment

#: Most devices of a random room.
DEVICES = 5
#: A table of an array that is symmetric about its centre has an imaginary part below this.
_REAL = 1e-6


class Batch(NamedTuple):
    """Moments of one body. Padded devices and pairs are zeros that nobody asks."""

    points: Float32[Tensor, "facet 3"]
    """Facets at rest [m]."""
    normals: Float32[Tensor, "facet 3"]
    areas_m2: Float32[Tensor, "facet"]
    turns: Float32[Tensor, "moment bone 3 3"]
    """Rotation of each bone from rest, around the centre of the maps."""
    moves: Float32[Tensor, "moment bone 3"]
    """Its translation, likewise [m]."""
    joints: Float32[Tensor, "moment 17 3"]
    """Joints around the centre of the maps [m]."""
    ends: Float32[Tensor, "moment device 2 3 3"]
    """Transmitter and receiver: centre around that of the maps [m], y axis, z axis."""
    table: Int64[Tensor, "moment device 2 2"]
    """Row of `tables` for either end along either axis."""
    tables: Float32[Tensor, "row sample"]
    """Responses of arrays, as `echoes.array_table`."""
    counts: Float32[Tensor, "moment device 2 2"]
    """log2 of the distinct places of elements along either axis."""
    above_m: Float32[Tensor, "moment device"]
    """Furniture hides what is lower from each device [m]."""
    walls_m: Float32[Tensor, "moment 3 2"]
    """Where the sides of the room are along each axis, around the centre [m]."""
    reflects: Float32[Tensor, "moment 3 2"]
    """Amplitude of a wave after each; 0 for no wall."""
    pairs: Int64[Tensor, "moment pair 2"]
    """Transmitting and receiving device."""
    there: Bool[Tensor, "moment pair"]
    """Which pairs are not padding."""
    band: Int64[Tensor, "moment"]
    """Row of `responses`."""
    responses: Complex64[Tensor, "row sample"]
    """Responses of bands, as `echoes.Band`, to `LOBES_OF_GAP` cells either side."""


def batch_of(radio: Radio, done: Acted, pairs: int) -> Batch:
    """The moments of a motion, on the CPU.

    Args:
        radio: The radio.
        done: At least one moment.
        pairs: Device pairs that are kept of each.
    """
    figure, moments = done.figure, done.moments
    count = len(moments)
    tables = _Rows()
    responses = _Rows()
    out = {
        "points": figure.points.astype("f4"),
        "normals": figure.normals.astype("f4"),
        "areas_m2": figure.areas_m2.astype("f4"),
        "turns": np.zeros((count, len(BONES), 3, 3), "f4"),
        "moves": np.zeros((count, len(BONES), 3), "f4"),
        "joints": np.zeros((count, 17, 3), "f4"),
        "ends": np.zeros((count, DEVICES, 2, 3, 3), "f4"),
        "table": np.zeros((count, DEVICES, 2, 2), np.int64),
        "counts": np.zeros((count, DEVICES, 2, 2), "f4"),
        "above_m": np.zeros((count, DEVICES), "f4"),
        "walls_m": np.zeros((count, 3, 2), "f4"),
        "reflects": np.zeros((count, 3, 2), "f4"),
        "pairs": np.zeros((count, pairs, 2), np.int64),
        "there": np.zeros((count, pairs), bool),
        "band": np.zeros(count, np.int64),
    }
    for row, moment in enumerate(moments):
        turns, moves = figure.body.from_rest(moment.pose)
        out["turns"][row], out["moves"][row] = turns, moves - moment.centre
        out["joints"][row] = figure.body.joints17(moment.pose) - moment.centre
        out["walls_m"][row] = moment.room.bounds_m.T - moment.centre[:, None]
        out["reflects"][row] = moment.room.reflects
        out["above_m"][row, : len(moment.sight.above_m)] = moment.sight.above_m - moment.centre[2]
        _place_devices(out, row, moment, tables)
        mask = moment.sight.subcarriers.tobytes()
        out["band"][row] = responses.row(mask, lambda mask=mask: _response(radio, mask))
        views = moment.views[:pairs]
        out["pairs"][row, : len(views)] = [view.pair for view in views]
        out["there"][row, : len(views)] = True
    out |= {"tables": np.stack(tables.values), "responses": np.stack(responses.values)}
    return Batch(**{name: torch.from_numpy(values) for name, values in out.items()})


class _Rows:
    """Arrays by key, each made once."""

    def __init__(self) -> None:
        self.values: list[np.ndarray] = []
        self._row: dict[bytes, int] = {}

    def row(self, key: bytes, make: Callable[[], np.ndarray]) -> int:
        """The row of an array, which is made if it is not there."""
        if key not in self._row:
            self._row[key] = len(self.values)
            self.values.append(make())
        return self._row[key]


def _place_devices(out: dict[str, np.ndarray], row: int, moment: Moment, tables: _Rows) -> None:
    """Fills in what a moment's devices send and hear with."""
    wavenumber = 2.0 * np.pi * float(moment.sight.freq_hz.mean()) / SPEED_OF_LIGHT
    done: set[tuple[int, int]] = set()
    for view in moment.views:
        for side, (device, end) in enumerate(zip(view.pair, (view.tx, view.rx), strict=True)):
            if (device, side) in done:
                continue
            done.add((device, side))
            out["ends"][row, device, side, 0] = end.centre - moment.centre
            out["ends"][row, device, side, 1:] = end.axes
            for axis in (0, 1):
                places = np.round(end.offsets[:, axis], 6)
                out["counts"][row, device, side, axis] = _log2_places(places.tobytes())
                out["table"][row, device, side, axis] = tables.row(
                    places.tobytes(), functools.partial(_real_table, end, axis, wavenumber)
                )


@functools.lru_cache(maxsize=256)
def _log2_places(places: bytes) -> float:
    """log2 of how many places there are."""
    return float(np.log2(distinct_places(np.frombuffer(places))))


def _real_table(end: ArrayEnd, axis: int, wavenumber: float) -> np.ndarray:
    """Response of an array along an axis: real, since elements lie symmetric about the centre."""
    table = array_table(end, axis, wavenumber)
    if len(table) == 0:
        return np.ones(TABLE, "f4")
    if np.abs(table.imag).max() > _REAL:
        raise ValueError("elements that are not symmetric about their centre")
    return table.real.astype("f4")


@functools.lru_cache(maxsize=64)
def _response(radio: Radio, mask: bytes) -> np.ndarray:
    """Response of a band of which some subcarriers are hidden, to `LOBES_OF_GAP` cells."""
    weights = band_window(np.frombuffer(mask, dtype=bool), hann)
    band = Band.of(radio.freq_hz, weights, skin_reflection(radio.centre_hz))
    out = np.zeros(2 * LOBES_OF_GAP * PER_CELL + 1, "c8")
    middle, half = len(out) // 2, len(band.response) // 2
    out[middle - half : middle + half + 1] = band.response
    return out
