# SPDX-License-Identifier: Apache-2.0
"""Rays of each scattering point by the wall they hit, and which of them Sionna would keep."""

from __future__ import annotations

import numba
import numpy as np

#: Ray that stands for none.
NEVER = np.iinfo(np.int64).max
_FNV_PRIME = np.uint64(1099511628211)
_BYTE = np.uint64(0xFF)


@numba.njit(cache=True, parallel=True)
def grouped(
    hashes: np.ndarray, active: np.ndarray, per_source: int
) -> tuple[np.ndarray, np.ndarray]:
    """Group of each ray within its source, −1 for none, and the number of groups per source.

    Rays of a source belong together when both hashes are equal.
    """
    num_sources = len(active) // per_source
    group = np.full(len(active), -1, dtype=np.int32)
    groups = np.zeros(num_sources, dtype=np.int64)
    size = 2
    while size < 2 * per_source:
        size *= 2
    for s in numba.prange(num_sources):
        slots = np.full(size, -1, dtype=np.int32)
        known = np.zeros((2, per_source), dtype=np.uint64)
        count = 0
        for ray in range(s * per_source, (s + 1) * per_source):
            if not active[ray]:
                continue
            a, b = hashes[0, ray], hashes[1, ray]
            slot = np.int64((a ^ (b >> np.uint64(7))) & np.uint64(size - 1))
            while slots[slot] >= 0 and (known[0, slots[slot]] != a or known[1, slots[slot]] != b):
                slot = (slot + 1) & (size - 1)
            if slots[slot] < 0:
                slots[slot] = count
                known[0, count], known[1, count] = a, b
                count += 1
            group[ray] = slots[slot]
        groups[s] = count
    return group, groups


@numba.njit(cache=True)
def by_group(
    group: np.ndarray, groups: np.ndarray, per_source: int
) -> tuple[np.ndarray, np.ndarray]:
    """Rays group by group, ascending in each, and where each group starts and the last ends."""
    offset = np.zeros(len(groups) + 1, dtype=np.int64)
    offset[1:] = np.cumsum(groups)
    start = np.zeros(offset[-1] + 1, dtype=np.int64)
    for ray in range(len(group)):
        if group[ray] >= 0:
            start[offset[ray // per_source] + group[ray] + 1] += 1
    start = np.cumsum(start)
    filled = start[:-1].copy()
    rays = np.zeros(start[-1], dtype=np.int64)
    for ray in range(len(group)):
        if group[ray] >= 0:
            at = offset[ray // per_source] + group[ray]
            rays[filled[at]] = ray
            filled[at] += 1
    return rays, start


@numba.njit(cache=True, parallel=True)
def wins(first: np.ndarray, hashes: np.ndarray, groups: np.ndarray, table: int) -> np.ndarray:
    """Which rays Sionna's hash tables let through, bool, shape (group, target).

    A ray counts when it is the first in both of its places in its source's tables; different
    walls may share a place.

    Args:
        first: First ray of each group that each target sees, shape (group, target).
        hashes: Both hashes of each group, uint64, shape (2, group).
        groups: Number of groups of each source, shape (source,).
        table: Places of a source.
    """
    won = first != NEVER
    ends = np.cumsum(groups)
    for s in numba.prange(len(groups)):
        smallest = np.zeros(table, dtype=np.int64)
        for part in range(2):
            smallest[:] = NEVER
            for g in range(ends[s] - groups[s], ends[s]):
                for t in range(first.shape[1]):
                    place = _place(hashes[part, g], t, table)
                    smallest[place] = min(smallest[place], first[g, t])
            for g in range(ends[s] - groups[s], ends[s]):
                for t in range(first.shape[1]):
                    if smallest[_place(hashes[part, g], t, table)] != first[g, t]:
                        won[g, t] = False
    return won


@numba.njit(cache=True, inline="always")
def _place(wall: np.uint64, target: int, table: int) -> np.int64:
    """Place of a wall and a target in a table: Sionna's FNV-1a over the target's four bytes."""
    mixed = wall
    for byte in range(4):
        part = (np.uint64(target) >> np.uint64(8 * byte)) & _BYTE
        mixed = (mixed ^ part) * _FNV_PRIME
    return np.int64(mixed % np.uint64(table))
