# SPDX-License-Identifier: Apache-2.0
"""What a table of paths must keep to: its own geometry, the scene, and the channel beside it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import DIFFRACTION, DIFFUSE, REFRACTION, SCATTERING, SPECULAR
from rfgs_core.radio.levels import decibels
from rfgs_core.radio.path_table import PathTable, ends_rad

#: Largest difference of a path's delay and the length of its corners [m].
LENGTH_LIMIT_M = 1e-4
#: Largest difference of a path's ends from the centres of its sites [m].
END_LIMIT_M = 1e-3
#: Largest difference of a path's angles from the directions of its corners [rad].
ANGLE_LIMIT_RAD = 1e-3
#: Energy of the difference from the channel, median over pairs of sites, by the elements that
#: are nearest to the sites' centres, relative to the channel's.
CHANNEL_LIMIT_DB = -20.0

_KINDS = (0, SPECULAR, DIFFUSE, REFRACTION, DIFFRACTION, SCATTERING)


def path_faults(sequence: Sequence, radio: str) -> Iterator[str]:
    """Checks the tables of a radio, the static one and those of all frames.

    Raises:
        RfgsError: A table is missing or damaged.
    """
    files = sequence.files
    static = sequence.csi_static(radio)
    yield from _table_faults(
        sequence, radio, files.paths(radio, None), sequence.paths_static(radio), static
    )
    for frame in sequence.frames:
        table, csi = sequence.paths(radio, frame), sequence.csi(radio, frame)
        yield from _table_faults(sequence, radio, files.paths(radio, frame), table, csi)


def _table_faults(
    sequence: Sequence, radio: str, file: Path, table: PathTable, csi: np.ndarray
) -> Iterator[str]:
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    faults = list(_scene_faults(sequence, layout, table))
    if not np.allclose(table.node_hz[[0, -1]], [spec.freq_min_hz, spec.freq_max_hz]):
        faults.append("node_hz: expected the edges of the band")
    yield from (f"{file}: {fault}" for fault in faults)
    if not faults:
        error_db = channel_error_db(table, layout, spec.freq_hz, csi)
        if error_db > CHANNEL_LIMIT_DB:
            yield f"{file}: adds up to another channel than the one stored ({error_db:.0f} dB)"


def _scene_faults(sequence: Sequence, layout: Layout, table: PathTable) -> Iterator[str]:
    """Faults of geometry and references."""
    if not len(table):
        yield "holds no path"
        return
    pairs = set(map(tuple, np.unique(_pairs(layout)[:, :2], axis=0).tolist()))
    if not set(zip(table.tx_site.tolist(), table.rx_site.tolist(), strict=True)) <= pairs:
        yield "tx_site, rx_site: pairs that are not measured"
        return
    yield from _end_faults(layout, table)
    length_m = np.linalg.norm(np.diff(table.vertices.astype(np.float64), axis=1), axis=2).sum(1)
    if np.abs(length_m - table.delay_s * SPEED_OF_LIGHT).max() > LENGTH_LIMIT_M:
        yield "delay_s: differs from the length of vertices"
    for name, angle in ends_rad(table.vertices.astype(np.float64), table.kind).items():
        off = np.angle(np.exp(1j * (angle - getattr(table, name))))
        # Straight up or down, azimuths mean nothing.
        steep = np.sin(getattr(table, name.replace("azimuth", "zenith")))
        if np.abs(off * (steep if "azimuth" in name else 1.0)).max() > ANGLE_LIMIT_RAD:
            yield f"{name}: differs from the direction of vertices"
    if not np.isin(table.kind, _KINDS).all():
        yield "kind: unknown codes"
    ids = [row["id"] for row in sequence.info.objects]
    if not np.isin(table.object[table.kind != 0], ids).all():
        yield "object: ids missing in sequence.json"


def _end_faults(layout: Layout, table: PathTable) -> Iterator[str]:
    """Faults of sites and devices at both ends."""
    for name, site, device in (
        ("tx", layout.tx_site, layout.tx_device),
        ("rx", layout.rx_site, layout.rx_device),
    ):
        xyz = layout.tx_xyz if name == "tx" else layout.rx_xyz
        own, end = getattr(table, f"{name}_site"), table.vertices[:, 0 if name == "tx" else -1]
        centres = np.stack([xyz[site == i].mean(axis=0) for i in range(site.max() + 1)])
        if np.abs(end - centres[own]).max() > END_LIMIT_M:
            yield f"vertices: paths that do not end at their {name}_site"
        owner = device[np.unique(site, return_index=True)[1]]
        if (owner[own] != getattr(table, f"{name}_device")).any():
            yield f"{name}_device: not the device of {name}_site"


def channel_error_db(
    table: PathTable, layout: Layout, freq_hz: np.ndarray, csi: np.ndarray
) -> float:
    """Energy of what paths leave unexplained, median over pairs of sites and ports [dB].

    Args:
        table: The paths.
        layout: Antenna elements.
        freq_hz: Subcarriers [Hz].
        csi: Channel, shape (tx, rx, subcarrier).
    """
    ratios = []
    for _, _, tx, rx in _pairs(layout).tolist():
        stored = csi[tx, rx].astype(np.complex128)
        error = np.abs(table.link(layout, tx, rx, freq_hz) - stored) ** 2
        ratios.append(error.sum() / max((np.abs(stored) ** 2).sum(), 1e-300))
    return float(decibels(float(np.median(ratios))))


def _pairs(layout: Layout) -> np.ndarray:
    """Measured pairs of sites: both sites, and of every port both elements nearest to the centre.

    Returns:
        TX site, RX site, TX element and RX element, shape (pair, 4).
    """
    chosen = []
    for xyz, site, port in (
        (layout.tx_xyz, layout.tx_site, layout.tx_port),
        (layout.rx_xyz, layout.rx_site, layout.rx_port),
    ):
        nearest = []
        for one, way in np.unique(np.stack([site, port], axis=1), axis=0):
            own = np.flatnonzero((site == one) & (port == way))
            away = np.linalg.norm(xyz[own] - xyz[site == one].mean(axis=0), axis=1)
            nearest.append((one, own[away.argmin()]))
        chosen.append(nearest)
    rows = [(a, b, tx, rx) for a, tx in chosen[0] for b, rx in chosen[1] if layout.measured[tx, rx]]
    return np.array(rows).reshape(-1, 4)
