# SPDX-License-Identifier: Apache-2.0
"""Physics that every traced channel must obey, checked against the geometry beside it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: A clear direct path must show with this amplitude relative to free space.
DIRECT_LIMITS = (0.5, 2.0)
#: Power that may arrive before the direct path, relative to the strongest arrival.
EARLY_LIMIT = 10 ** (-25 / 10)
#: Main lobe of the Hann window used on the band, in units of c / bandwidth.
HANN_LOBE = 2.5


def channel_faults(sequence: Sequence, radio: str, static: np.ndarray, file: Path) -> Iterator[str]:
    """Compares the static channel with straight lines between the antennas.

    Two laws: nothing arrives before light can, and where nothing blocks the line of sight the
    direct path has Friis' amplitude λ/(4πd) and delay d/c.
    """
    layout = sequence.layout(radio)
    if not np.isfinite(static).all():
        yield f"{file}: static channel: values that are not finite"
        return
    if not static[layout.measured].any():
        yield f"{file}: static channel: silent"
        return
    vertices, faces = sequence.static_mesh()
    triangles = vertices[faces].astype(np.float64)
    for a, b in _pairs(layout):
        tx, rx = layout.tx_device == a, layout.rx_device == b
        links = static[np.ix_(tx, rx)]
        distance_m = np.linalg.norm(layout.tx_xyz[tx][:, None] - layout.rx_xyz[rx][None], axis=-1)
        where = f"{file}: devices {a} to {b}"
        early = _early_power(sequence, radio, links, float(distance_m.min()))
        if early > EARLY_LIMIT:
            yield f"{where}: {10 * np.log10(early):.0f} dB arrive before the direct path can"
        start, end = layout.tx_xyz[tx].mean(axis=0), layout.rx_xyz[rx].mean(axis=0)
        if a != b and not blocked(start, end, triangles):
            gain = _direct_gain(sequence, radio, links, distance_m)
            if not DIRECT_LIMITS[0] <= gain <= DIRECT_LIMITS[1]:
                yield (
                    f"{where}: the direct path over {distance_m.mean():.2f} m has {gain:.2f} of "
                    "its free-space amplitude at its delay"
                )


def blocked(start: np.ndarray, end: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether any triangle (T, 3, 3) crosses a segment (Möller and Trumbore 1997)."""
    ray = end - start
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    cross = np.cross(ray, edge2)
    det = (edge1 * cross).sum(axis=1)
    inverse = 1.0 / np.where(np.abs(det) < 1e-12, np.inf, det)
    offset = start - triangles[:, 0]
    u = (offset * cross).sum(axis=1) * inverse
    turned = np.cross(offset, edge1)
    v = (turned @ ray) * inverse
    t = (edge2 * turned).sum(axis=1) * inverse
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6) & (t < 1 - 1e-6)
    return bool((hit & (np.abs(det) >= 1e-12)).any())


def _pairs(layout: Layout) -> list[tuple[int, int]]:
    tx, rx = np.nonzero(layout.measured)
    pairs = np.unique(np.stack([layout.tx_device[tx], layout.rx_device[rx]], axis=1), axis=0)
    return [(int(a), int(b)) for a, b in pairs]


def _early_power(sequence: Sequence, radio: str, links: np.ndarray, nearest_m: float) -> float:
    """Strongest arrival earlier than light allows, relative to the strongest of all."""
    spec = sequence.radio_spec(radio)
    tones = spec.num_subcarriers
    profile = np.fft.ifft(links * np.hanning(tones), axis=-1)
    power = (np.abs(profile) ** 2).mean(axis=(0, 1))
    cell_m = SPEED_OF_LIGHT / spec.bandwidth_hz
    length_m = np.arange(tones) * cell_m
    # The last third of the profile is negative delay: no path of a checked scene is that long.
    length_m = np.where(
        length_m > 2 / 3 * spec.unambiguous_path_m, length_m - tones * cell_m, length_m
    )
    early = power[length_m < nearest_m - HANN_LOBE * cell_m]
    return float(early.max() / power.max()) if len(early) else 0.0


def _direct_gain(
    sequence: Sequence, radio: str, links: np.ndarray, distance_m: np.ndarray
) -> float:
    """Amplitude at the direct path's exact delays relative to Friis, coherent over elements."""
    freq_hz = sequence.radio_spec(radio).freq_hz
    phase = 2 * np.pi * freq_hz / SPEED_OF_LIGHT * distance_m[..., None]
    friis = SPEED_OF_LIGHT / freq_hz / (4 * np.pi * distance_m[..., None])
    return float(np.abs((links / friis * np.exp(1j * phase)).mean()))
