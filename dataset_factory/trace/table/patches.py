# SPDX-License-Identifier: Apache-2.0
"""People's paths gathered into rows of a table: one per patch of skin and way.

A person scatters from thousands of facets. Facets of one patch whose paths meet the same planes
in the same order add up to one row: its amplitude is their coherent sum, its corners are those
of a path by way of their power-weighted centre. A patch is small enough that the sum bends
little from one frequency of the amplitudes to the next, so the row holds over the whole band.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.trace.bounces.follow import follow
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.antennas import field, passed_on
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import REFRACTION, SCATTERING, directions
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.sites import centres, owners, ports, site_pairs
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.surface.direct import PosedPoints

#: Largest patch [m]; keeps limbs apart and arrays in the far field of what one scatters.
LARGEST_PATCH_M = 0.2
#: Rows weaker than this share of their pair's strongest row of people are left out.
NEGLIGIBLE = 1e-3
#: Planes of one object are the same within so much of their normals and distances [m].
_SAME_NORMAL, _SAME_PLANE_M = 0.02, 0.1
#: Shifts the limits between planes away from the round numbers that walls stand at.
_OFF_ROUND = 0.137


def patch_size_m(nodes_hz: np.ndarray) -> float:
    """Size of a patch for amplitudes at some frequencies [Hz].

    Both ways across half of it turn the phase by π/8 from one frequency to the next.
    """
    return min(LARGEST_PATCH_M, SPEED_OF_LIGHT / (16.0 * float(nodes_hz[1] - nodes_hz[0])))


def patches(rest: np.ndarray, group: np.ndarray, size_m: float) -> np.ndarray:
    """Patch of each point: a cell of a grid in the rest pose, within one group.

    Args:
        rest: Points in the rest pose [m], shape (point, 3).
        group: Columns that a patch must share, such as instance and segment, (point, column).
        size_m: Size of the cells [m].
    """
    cells = np.floor(rest / size_m).astype(np.int64)
    keys = np.concatenate([group, cells], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def direct_paths(
    points: PosedPoints,
    seen: np.ndarray,
    layout: Layout,
    devices: list[DevicePose],
    radio: Radio,
) -> PathSet:
    """Paths straight to points and on, between centres of sites, as `Bounces.paths` gives them.

    Args:
        points: Scattering points.
        seen: As `direct.in_sight` tells.
        layout: Antenna elements.
        devices: Poses of the devices, for pattern and polarisation.
        radio: Gives band, antenna pattern and polarisation.

    Returns:
        Paths of unit cross-section, one amplitude each.
    """
    positions = points.positions
    tx_centres, rx_centres = centres(layout)
    tx_owner, rx_owner = owners(layout)
    columns = []
    for a, b in site_pairs(layout):
        index = np.flatnonzero(seen[a, b])
        into, out_of = positions[index] - tx_centres[a], rx_centres[b] - positions[index]
        axes = (rotation(devices[owner].quat_wxyz) for owner in (tx_owner[a], rx_owner[b]))
        tx_axes, rx_axes = axes
        spread = np.linalg.norm(into, axis=1) * np.linalg.norm(out_of, axis=1)
        unit = SPEED_OF_LIGHT / radio.centre_hz / ((4.0 * np.pi) ** 1.5 * spread)
        amplitude = [
            unit
            * passed_on(
                into,
                out_of,
                field(radio.pattern, radio.slants_deg[i], into, tx_axes),
                field(radio.pattern, radio.slants_deg[j], -out_of, rx_axes),
            )
            for i, j in ports(layout)
        ]
        ends = (np.broadcast_to(end, into.shape) for end in (tx_centres[a], rx_centres[b]))
        start, end = ends
        pair = np.broadcast_to([a, b], (len(index), 2))
        columns.append((pair, amplitude, np.stack([start, positions[index], end], axis=1), index))
    pairs = np.concatenate([column[0] for column in columns])
    index = np.concatenate([column[3] for column in columns])[:, None]
    return PathSet(
        tx=pairs[:, 0],
        rx=pairs[:, 1],
        amplitude=np.concatenate([np.stack(c[1], axis=1) for c in columns])[..., None] + 0j,
        vertices=np.concatenate([column[2] for column in columns]),
        kinds=np.full_like(index, SCATTERING),
        primitives=index,
        objects=np.zeros_like(index),
    )


def gathered(
    paths: PathSet, points: PosedPoints, patch: np.ndarray, nodes_hz: np.ndarray
) -> tuple[PathSet, np.ndarray, np.ndarray]:
    """One path for each patch and way.

    Args:
        paths: Paths with one scattering point each and an amplitude per node.
        points: The points.
        patch: Patch of each point.
        nodes_hz: Frequencies of the amplitudes [Hz].

    Returns:
        The rows, whose `primitives` is the strongest point at the scattering corner; the row of
        each path; and the share of its row's power that each path has.
    """
    row = np.unique(_ways(paths, patch), axis=0, return_inverse=True)[1].ravel()
    count = int(row.max()) + 1
    power = (np.abs(paths.amplitude[:, :, len(nodes_hz) // 2]) ** 2).sum(axis=1)
    order = np.lexsort((-power, row))
    strongest = order[np.unique(row[order], return_index=True)[1]]
    share = power / np.bincount(row, power, count)[row]
    at = np.argmax(paths.kinds == SCATTERING, axis=1)
    point = paths.primitives[np.arange(len(paths)), at]
    positions = points.positions[point]
    centre = np.stack([np.bincount(row, share * positions[:, i], count) for i in range(3)], axis=1)
    chosen = paths.select(strongest)
    numbered = np.where(chosen.kinds == SCATTERING, np.arange(count)[:, None], chosen.primitives)
    rows = follow(replace(chosen, primitives=numbered), centre)
    late_m = paths.length_m - rows.length_m[row]
    wavenumber = 2.0 * np.pi * nodes_hz / SPEED_OF_LIGHT
    turned = paths.amplitude * np.exp(-1j * wavenumber * late_m[:, None])[:, None]
    amplitude = np.zeros((count, *turned.shape[1:]), dtype=np.complex128)
    np.add.at(amplitude, row, turned)
    return replace(rows, amplitude=amplitude, primitives=chosen.primitives), row, share


def strong(rows: PathSet) -> np.ndarray:
    """Which rows are not negligible beside the strongest of their pair, bool, shape (path,)."""
    size = np.abs(rows.amplitude).max(axis=(1, 2))
    pair = rows.tx * (int(rows.rx.max()) + 1) + rows.rx
    strongest = np.zeros(int(pair.max()) + 1)
    np.maximum.at(strongest, pair, size)
    return size > NEGLIGIBLE * strongest[pair]


def _ways(paths: PathSet, patch: np.ndarray) -> np.ndarray:
    """What paths of one row share: ends, patch, and kind, object and plane at each corner."""
    scatters = paths.kinds == SCATTERING
    k = directions(paths.vertices)
    normal = k[:, 1:] - k[:, :-1]
    bends = (paths.kinds != 0) & (paths.kinds != REFRACTION) & ~scatters
    size = np.linalg.norm(normal, axis=2, keepdims=True)
    normal = np.where(bends[..., None], normal / np.maximum(size, 1e-12), 0.0)
    distance_m = np.sum(normal * paths.vertices[:, 1:-1], axis=2)
    of_patch = patch[np.where(scatters, paths.primitives, 0)]
    what = np.where(scatters, of_patch, paths.objects)
    planes = np.concatenate([normal / _SAME_NORMAL, distance_m[..., None] / _SAME_PLANE_M], axis=2)
    planes = np.floor(planes + 0.5 + _OFF_ROUND).astype(np.int64).reshape(len(paths), -1)
    return np.concatenate([paths.tx[:, None], paths.rx[:, None], paths.kinds, what, planes], axis=1)
