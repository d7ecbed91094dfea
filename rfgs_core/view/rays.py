# SPDX-License-Identifier: Apache-2.0
"""Ways of the waves between devices: as they were traced, else as mirrors in the room give them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8

from rfgs_core.dataset import Sequence
from rfgs_core.radio.images import SCATTERING
from rfgs_core.radio.sites import centres, measured_pairs
from rfgs_core.simulate.geometry import Sight, specular_paths
from rfgs_core.simulate.geometry.faces import faces_of

#: Walls that a way may meet where it was not traced, and ways that are drawn at most: more of
#: either hide the room.
WALLS, MOST = 1, 150
#: Traced ways this much weaker than the strongest are left out [dB].
SPAN_DB = 50.0
#: Colours: straight, by one wall, by more, and by way of whoever moves.
STRAIGHT, ONE, MORE, PEOPLE = (240, 240, 240), (255, 176, 60), (70, 120, 190), (255, 90, 200)


class Rays(NamedTuple):
    """Ways as segments."""

    segments: Float32[np.ndarray, "segment 2 3"]
    """From corner to corner [m]."""
    colors: UInt8[np.ndarray, "segment 3"]
    """By what a way has met."""
    traced: bool
    """Whether the dataset stores them; else they were found in its mesh."""


def rays_of(sequence: Sequence, radio: str, frame: int) -> Rays | None:
    """Ways between the devices of a radio at a frame; None where antennas move.

    Raises:
        RfgsFormatError: A table or mesh is damaged.
    """
    if sequence.radio_spec(radio).antennas_move:
        return None
    if sequence.files.paths(radio, frame).is_file():
        return _traced(sequence, radio, frame)
    return _mirrored(sequence, radio)


def follows_frames(sequence: Sequence, radio: str) -> bool:
    """Whether ways differ from frame to frame: those that were traced do."""
    return sequence.files.paths(radio, sequence.frames[0]).is_file()


def _traced(sequence: Sequence, radio: str, frame: int) -> Rays:
    """The strongest stored ways, those of people in their own colour."""
    table = sequence.paths(radio, frame)
    gain = np.abs(table.amplitude).max(axis=(1, 2))
    order = np.argsort(-gain, kind="stable")[:MOST]
    floor = 10.0 ** (-SPAN_DB / 20.0) * gain.max(initial=0.0)
    order = order[gain[order] > floor]
    kind, corners = table.kind[order], table.vertices[order]
    met = (kind != 0).sum(axis=1)
    colors = _colors(met)
    colors[(kind == SCATTERING).any(axis=1)] = PEOPLE
    return _as_segments(corners, met, colors, traced=True)


def _mirrored(sequence: Sequence, radio: str) -> Rays:
    """Straight ways, and those that one face of the room mirrors or lets through."""
    triangles = np.zeros((0, 3, 3))
    if sequence.files.static_mesh.is_file():
        vertices, faces = sequence.static_mesh()
        triangles = vertices[faces].astype(np.float64)
    layout = sequence.layout(radio)
    tx, rx = centres(layout)
    around = Sight(tx, rx).of(
        faces_of(triangles, np.zeros(len(triangles), np.int64)), np.zeros(len(triangles), bool)
    )
    found = specular_paths(around, measured_pairs(layout), WALLS)
    met = (found.kinds != 0).sum(axis=1)
    order = np.argsort(met, kind="stable")[:MOST]
    ends = tx[found.tx][:, None], rx[found.rx][:, None]
    corners = np.concatenate([ends[0], found.corners, ends[1]], axis=1)[order]
    return _as_segments(corners, met[order], _colors(met[order]), traced=False)


def _colors(met: np.ndarray) -> UInt8[np.ndarray, "path 3"]:
    """A colour by how many walls a way has met."""
    return np.array([STRAIGHT, ONE, MORE], np.uint8)[np.minimum(met, 2)]


def _as_segments(corners: np.ndarray, met: np.ndarray, colors: np.ndarray, *, traced: bool) -> Rays:
    """Polylines [m], (path, corner, 3), as segments; corners beyond the last are the receiver's."""
    pairs = np.stack([corners[:, :-1], corners[:, 1:]], axis=2)
    used = np.arange(pairs.shape[1]) <= met[:, None]
    each = np.broadcast_to(colors[:, None], (*used.shape, 3))
    return Rays(pairs[used].astype(np.float32), each[used], traced)
