# SPDX-License-Identifier: Apache-2.0
"""Propagation paths between sites of antennas, in an order that does not depend on threads."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from rfgs_core.radio.images import SPECULAR, breaks


@dataclass(frozen=True)
class PathSet:
    """Paths between pairs of sites, sorted by pair, length and vertices."""

    tx: np.ndarray
    """Transmitting site of each path, int64, shape (path,)."""
    rx: np.ndarray
    """Receiving site of each path, int64, shape (path,)."""
    amplitude: np.ndarray
    """Amplitude without the phase of the delay, complex128, shape (path, port pair, node)."""
    vertices: np.ndarray
    """Corners from transmitter to receiver [m], padded with the receiver, (path, depth + 2, 3)."""
    kinds: np.ndarray
    """Sionna's interaction codes, 0 beyond the last, shape (path, depth)."""
    primitives: np.ndarray
    """Triangle, or scattering point, of each interaction, shape (path, depth)."""
    objects: np.ndarray
    """Sionna's number of the object of each interaction, shape (path, depth)."""

    def __len__(self) -> int:
        return len(self.tx)

    @property
    def length_m(self) -> np.ndarray:
        """Length of each path between centres of sites [m], shape (path,)."""
        return np.linalg.norm(np.diff(self.vertices, axis=1), axis=2).sum(axis=1)

    def select(self, keep: np.ndarray) -> PathSet:
        """The paths of a mask or of indices, in that order."""
        return PathSet(
            self.tx[keep],
            self.rx[keep],
            self.amplitude[keep],
            self.vertices[keep],
            self.kinds[keep],
            self.primitives[keep],
            self.objects[keep],
        )

    def sorted(self) -> PathSet:
        """The same paths ordered by pair, length, interactions and amplitude."""
        amplitude = self.amplitude[:, 0, 0]
        keys = [amplitude.imag, amplitude.real]
        keys += [
            self.vertices[:, i, axis]
            for i in range(1, self.vertices.shape[1] - 1)
            for axis in range(3)
        ]
        keys += [*self.primitives.T, *self.kinds.T, self.length_m, self.rx, self.tx]
        return self.select(np.lexsort(keys))

    def breaks(self) -> np.ndarray:
        """Interactions after which a path no longer has one mirror image, bool (path, depth)."""
        return breaks(self.kinds)

    def mirrors(self) -> np.ndarray:
        """Interactions that mirror the way, bool, shape (path, depth)."""
        return self.kinds == SPECULAR


def empty(depth: int, nodes: int = 1) -> PathSet:
    """A set without paths."""
    index = np.zeros(0, dtype=np.int64)
    table = np.zeros((0, depth), dtype=np.int64)
    amplitude = np.zeros((0, 1, nodes), np.complex128)
    return PathSet(index, index, amplitude, np.zeros((0, depth + 2, 3)), table, table, table)


def merged(parts: list[PathSet]) -> PathSet:
    """All paths of several sets of equal depth, sorted."""
    parts = [part for part in parts if len(part)]
    if not parts:
        return empty(0)
    depth = max(part.kinds.shape[1] for part in parts)
    return _concatenated([_padded(part, depth) for part in parts]).sorted()


def joined(sets: list[PathSet]) -> PathSet:
    """One set of paths over several frequencies; a path missing at one is zero there.

    Rays choose between reflection and refraction by the material, so a weak path may be found
    at some frequencies only. Paths are the same when their interactions and corners are.

    Args:
        sets: Paths at each frequency, of equal depth, one amplitude node each.

    Returns:
        Paths with one amplitude per frequency.
    """
    filled = [(node, paths) for node, paths in enumerate(sets) if len(paths)]
    if not filled:
        return empty(0, len(sets))
    node = np.concatenate([np.full(len(paths), node) for node, paths in filled])
    every = _concatenated([paths for _, paths in filled])
    _, first, row = np.unique(_keys(every), axis=0, return_index=True, return_inverse=True)
    amplitude = np.zeros((len(first), every.amplitude.shape[1], len(sets)), dtype=np.complex128)
    # Zipped axes first, so that each row of a path adds to its own frequency.
    np.add.at(amplitude.transpose(0, 2, 1), (row.ravel(), node), every.amplitude[:, :, 0])
    return replace(every.select(first), amplitude=amplitude).sorted()


def _concatenated(sets: list[PathSet]) -> PathSet:
    """Sets of equal depth one after the other."""
    columns = (column.name for column in fields(PathSet))
    return PathSet(*(np.concatenate([getattr(part, name) for part in sets]) for name in columns))


def _keys(paths: PathSet) -> np.ndarray:
    """What makes paths the same: ends, interactions and corners to the millimetre."""
    corners = np.round(paths.vertices * 1e3).astype(np.int64).reshape(len(paths), -1)
    return np.concatenate([paths.tx[:, None], paths.rx[:, None], paths.kinds, corners], axis=1)


def _padded(part: PathSet, depth: int) -> PathSet:
    """The same set with room for `depth` interactions."""
    extra = depth - part.kinds.shape[1]
    if extra == 0:
        return part
    end = np.repeat(part.vertices[:, -1:], extra, axis=1)
    return PathSet(
        part.tx,
        part.rx,
        part.amplitude,
        np.concatenate([part.vertices, end], axis=1),
        np.pad(part.kinds, ((0, 0), (0, extra))),
        np.pad(part.primitives, ((0, 0), (0, extra))),
        np.pad(part.objects, ((0, 0), (0, extra))),
    )
