# SPDX-License-Identifier: Apache-2.0
"""Every specular path between antennas, found by images rather than by rays.

A path is mirrored by up to `depth` plane faces and passes straight through others; both count.
Each sequence of mirrors has one candidate, the straight line from image to image, so the search
is exhaustive: one mirror after another for one or two, and for three the beams from both ends
that meet on the face in the middle. Nothing depends on a number of rays, and exchanging the ends
gives the same paths reversed. What decides is then a test of every segment in double precision.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from jaxtyping import Bool

from rfgs_core.radio.images import REFRACTION, SPECULAR
from rfgs_core.simulate.geometry.beams import Beams, beams, onward
from rfgs_core.simulate.geometry.bvh import SAME_M, triangle_at
from rfgs_core.simulate.geometry.faces import Faces, height, holds, mirrored
from rfgs_core.simulate.geometry.rays import crossings
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.threads import in_threads

#: Interactions of a path at most.
MAX_DEPTH = 3
#: Most transmitters whose beams are kept at hand.
_KEPT = 8


class SpecularPaths(NamedTuple):
    """Paths between pairs of antennas, sorted by pair and by the faces that mirror them."""

    tx: np.ndarray
    """Transmitter of each path, int64, shape (path,)."""
    rx: np.ndarray
    """Receiver of each path, int64, shape (path,)."""
    kinds: np.ndarray
    """`SPECULAR` or `REFRACTION` at each corner, 0 beyond the last, shape (path, depth)."""
    triangles: np.ndarray
    """Triangle at each corner, −1 beyond the last, shape (path, depth)."""
    corners: np.ndarray
    """Where [m], shape (path, depth, 3); the receiver beyond the last."""


def specular_paths(
    around: Surroundings, wanted: Bool[np.ndarray, "tx rx"], depth: int = MAX_DEPTH
) -> SpecularPaths:
    """Paths with up to `depth` reflections and crossings between antennas.

    Args:
        around: Faces and antennas.
        wanted: Pairs to search for.
        depth: Most reflections and crossings of a path, 0 to 3.

    Raises:
        ValueError: `depth` is not between 0 and 3.
    """
    if not 0 <= depth <= MAX_DEPTH:
        raise ValueError(f"depth {depth}: expected 0 to {MAX_DEPTH}")
    faces, tx_xyz, rx_xyz = around.faces, around.tx_xyz, around.rx_xyz

    def lit(place: np.ndarray, behind: np.ndarray) -> Beams:
        return beams(faces, place, np.flatnonzero(behind == 0))

    def of_receiver(rx: int) -> list[np.ndarray]:
        """What is found between a receiver and all its transmitters."""
        r, r_hidden = rx_xyz[rx], around.rx_hidden[rx]
        r_beams = lit(r, r_hidden)
        found = []
        for tx in np.flatnonzero(wanted[:, rx]):
            t, t_hidden = tx_xyz[tx], around.tx_hidden[tx]
            t_beams = tx_beams[tx] if tx_beams else lit(t, t_hidden)
            chains = [np.full((1, MAX_DEPTH), -1)]
            if depth > 0:
                chains.append(_by_one(faces, t, r, t_hidden, r_hidden))
            if depth > 1:
                chains.append(_by_two(faces, r, t_beams, r_hidden <= 1))
                # At most one surface stands in the way: one end at least has its mirror in sight.
                back = _by_two(faces, t, r_beams, t_hidden == 1)
                chains.append(back[:, [1, 0, 2]])
            if depth > 2:
                chains.append(_by_three(faces, t_beams, r_beams))
            found.append(_verified(faces, t, r, np.concatenate(chains), depth))
        return found

    receivers = [int(rx) for rx in np.flatnonzero(wanted.any(axis=0))]
    # Beams of many transmitters would fill the memory; each of those has few receivers.
    kept = zip(tx_xyz, around.tx_hidden, strict=True) if len(tx_xyz) <= _KEPT else ()
    tx_beams = in_threads(lambda one: lit(*one), kept)
    rows = in_threads(of_receiver, receivers)
    return _assembled(wanted, receivers, rows, rx_xyz, depth)


def _assembled(
    wanted: np.ndarray, receivers: list[int], rows: list, rx_xyz: np.ndarray, depth: int
) -> SpecularPaths:
    """All paths in one set, by transmitter and receiver."""
    parts = {}
    for rx, found in zip(receivers, rows, strict=True):
        for tx, part in zip(np.flatnonzero(wanted[:, rx]), found, strict=True):
            parts[int(tx), rx] = part
    pairs = sorted(parts)
    count = [len(parts[pair][0]) for pair in pairs]
    ends = np.repeat(np.array(pairs, dtype=np.int64).reshape(-1, 2), count, axis=0)
    nothing = (
        np.zeros((0, depth), np.int64),
        np.zeros((0, depth), np.int64),
        np.zeros((0, depth, 3)),
    )
    rows = [nothing, *(parts[pair] for pair in pairs)]
    kinds, triangles, corners = (np.concatenate(column) for column in zip(*rows, strict=True))
    corners = np.where((kinds == 0)[:, :, None], rx_xyz[ends[:, 1]][:, None], corners)
    return SpecularPaths(ends[:, 0], ends[:, 1], kinds, triangles, corners)


@numba.njit(cache=True, nogil=True)
def _through(
    faces: Faces, face: int, start: np.ndarray, end: np.ndarray, place: np.ndarray
) -> bool:
    """Whether the line between two places crosses a face's rectangle, and where."""
    a, b = height(faces, face, start), height(faces, face, end)
    if a * b >= 0.0:
        return False
    t = a / (a - b)
    for axis in range(3):
        place[axis] = start[axis] + t * (end[axis] - start[axis])
    return holds(faces, face, place)


@numba.njit(cache=True, nogil=True)
def _by_one(
    faces: Faces, tx: np.ndarray, rx: np.ndarray, tx_hidden: np.ndarray, rx_hidden: np.ndarray
) -> np.ndarray:
    """Single mirrors that may join two antennas, shape (chain, 3), −1 beyond the last."""
    found = [(-1, -1, -1)]
    place = np.zeros(3)
    for face in range(len(faces.normal)):
        # Either end may stand behind surfaces, two in all, and samples may miss the gap.
        if min(tx_hidden[face], rx_hidden[face]) > 1:
            continue
        if _through(faces, face, mirrored(faces, face, tx), rx, place):
            found.append((face, -1, -1))
    return np.array(found)[1:]


@numba.njit(cache=True, nogil=True)
def _by_two(faces: Faces, rx: np.ndarray, from_tx: Beams, lit: np.ndarray) -> np.ndarray:
    """Pairs of mirrors that may join beams to an antenna by way of a lit second mirror."""
    found = [(-1, -1, -1)]
    everywhere = np.array([-np.inf, np.inf, -np.inf, np.inf])
    seen, meets = np.zeros(3), np.zeros(_longest(from_tx), dtype=np.bool_)
    for last in np.flatnonzero(lit):
        begin, end = from_tx.start[last], from_tx.start[last + 1]
        seen[0] = (faces.axes[last, 0] * rx).sum()
        seen[1] = (faces.axes[last, 1] * rx).sum()
        seen[2] = height(faces, last, rx)
        onward(from_tx, begin, end, seen, everywhere, meets)
        for k in np.flatnonzero(meets[: end - begin]):
            found.append((from_tx.by[begin + k], last, -1))
    return np.array(found)[1:]


@numba.njit(cache=True, nogil=True)
def _by_three(faces: Faces, from_tx: Beams, from_rx: Beams) -> np.ndarray:
    """Triples of mirrors that may join two antennas: beams of both that meet on the second."""
    found = [(-1, -1, -1)]
    rim = np.zeros(4)
    meets = np.zeros(_longest(from_rx), dtype=np.bool_)
    for face in range(len(faces.normal)):
        begin, wide, end = from_rx.start[face], from_rx.narrow_start[face], from_rx.start[face + 1]
        if begin == end:
            continue
        widest = (from_rx.high[0, wide:end] - from_rx.low[0, wide:end]).max() if wide < end else 0.0
        places = from_rx.low[0, wide:end]
        for i in range(from_tx.start[face], from_tx.start[face + 1]):
            rim[0], rim[1] = from_tx.low[0, i], from_tx.high[0, i]
            rim[2], rim[3] = from_tx.low[1, i], from_tx.high[1, i]
            # Narrow footprints stand in order of place: only those nearby can meet this one.
            first = wide + np.searchsorted(places, rim[0] - widest, side="left")
            last = wide + np.searchsorted(places, rim[1], side="right")
            for some, stop in ((begin, wide), (first, last)):
                onward(from_rx, some, stop, from_tx.seen[:, i], rim, meets)
                for k in range(stop - some):
                    if meets[k]:
                        found.append((from_tx.by[i], face, from_rx.by[some + k]))
    return np.array(found)[1:]


@numba.njit(cache=True, nogil=True)
def _longest(beams: Beams) -> int:
    """Most beams that fall on one face."""
    longest = 0
    for face in range(len(beams.start) - 1):
        longest = max(longest, beams.start[face + 1] - beams.start[face])
    return longest


@numba.njit(cache=True, nogil=True)
def _verified(
    faces: Faces, tx: np.ndarray, rx: np.ndarray, chains: np.ndarray, depth: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kinds, triangles and corners of the chains that are paths."""
    count = 0
    kinds = np.zeros((len(chains), depth), dtype=np.int64)
    triangles = np.full((len(chains), depth), -1, dtype=np.int64)
    corners = np.zeros((len(chains), depth, 3))
    mirrors = np.zeros((depth, 3))
    for chain in chains:
        kinds[count], triangles[count], corners[count] = 0, -1, 0.0
        if not _mirror_places(faces, tx, rx, chain, mirrors):
            continue
        if not _path(faces, tx, rx, chain, mirrors, kinds[count], triangles[count], corners[count]):
            continue
        known = False
        for k in range(count):
            distance_m = np.abs(corners[k] - corners[count]).max() if depth else 0.0
            known |= distance_m < SAME_M and (kinds[k] == kinds[count]).all()
        if not known:
            count += 1
    return kinds[:count], triangles[:count], corners[:count]


@numba.njit(cache=True, nogil=True)
def _mirror_places(
    faces: Faces, tx: np.ndarray, rx: np.ndarray, chain: np.ndarray, places: np.ndarray
) -> bool:
    """Where a path meets each of its mirrors, from the last to the first."""
    order = 0
    images = np.zeros((len(chain) + 1, 3))
    images[0] = tx
    while order < len(chain) and chain[order] >= 0:
        images[order + 1] = mirrored(faces, chain[order], images[order])
        order += 1
    target = rx
    for i in range(order - 1, -1, -1):
        if not _through(faces, chain[i], images[i + 1], target, places[i]):
            return False
        target = places[i]
    return True


@numba.njit(cache=True, nogil=True)
def _path(
    faces: Faces,
    tx: np.ndarray,
    rx: np.ndarray,
    chain: np.ndarray,
    mirrors: np.ndarray,
    kinds: np.ndarray,
    triangles: np.ndarray,
    corners: np.ndarray,
) -> bool:
    """Fills in what a path meets; False if more than it may, or not its own mirrors."""
    depth = len(kinds)
    at_m, hit = np.zeros(depth + 1), np.zeros(depth + 1, dtype=np.int64)
    here, used = tx, 0
    for i in range(len(chain) + 1):
        last = i == len(chain) or chain[i] < 0
        place = rx if last else mirrors[i]
        way = place - here
        length = np.sqrt((way * way).sum())
        if length <= SAME_M:
            return False
        # What merely touches the end of a segment does not count, from whichever side it comes.
        found = crossings(faces.bvh, here, place, 2.0 * SAME_M, at_m, hit)
        if found + used + (0 if last else 1) > depth:
            return False
        for k in range(found):
            kinds[used], triangles[used] = REFRACTION, hit[k]
            corners[used] = here + way * (at_m[k] / length)
            used += 1
        if last:
            return True
        mirror = triangle_at(faces.bvh, faces.of_triangle, chain[i], place)
        if mirror < 0:
            return False
        kinds[used], triangles[used], corners[used] = SPECULAR, mirror, place
        used += 1
        here = place
    return True
