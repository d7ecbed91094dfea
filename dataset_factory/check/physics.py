# SPDX-License-Identifier: Apache-2.0
"""Physics that every traced channel must obey, checked against the geometry beside it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rfgs_core.dataset import Sequence
from rfgs_core.radio import DevicePose, Layout, Radio, devices_at, layout
from rfgs_core.radio.antennas import field
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.delay import delay_profile, hann_to_zero
from rfgs_core.radio.layout import rotation
from rfgs_core.radio.levels import amplitude_of, decibels, power_of

#: Median amplitude of clear direct paths relative to free space; one path alone may add to a
#: grazing reflection that nothing resolves, the median over links may not.
DIRECT_LIMITS = (0.4, 2.5)
#: Power that may arrive before the direct path, relative to the strongest arrival.
EARLY_LIMIT = power_of(-25.0)
#: How much less counts what may as well be late by nearly a whole period of the profile.
LATE_SHARE = power_of(-10.0)
#: Energy of all links relative to free space; reflections that add in phase stay below it.
ENERGY_LIMIT = 6.0
#: Peak power gain of Sionna's antenna patterns.
PEAK_GAINS = {"iso": 1.0, "dipole": 1.5, "hw_dipole": 1.64, "tr38901": 6.31}
#: Weaker antenna responses are left out: reflections outshine a direct path in a null.
WEAK_RESPONSE = 0.3
#: Sine of the angle to a device's own axis within which polarisation has no defined direction.
AXIS_SINE = 0.02
#: Main lobe of the Hann window used on the band, in units of c / bandwidth.
HANN_LOBE = 2.5


def channel_faults(sequence: Sequence, radio: str, static: np.ndarray, file: Path) -> Iterator[str]:
    """Compares the static channel with straight lines between the antennas.

    Two laws: nothing arrives before light can, and where nothing blocks the line of sight the
    direct path has Friis' amplitude λ/(4πd), times both antennas' responses, and delay d/c.

    Args:
        sequence: The sequence.
        radio: Which radio.
        static: Its static channels (sample, tx, rx, subcarrier), several if antennas move.
        file: Where they are stored.
    """
    spec, devices = sequence.radio_spec(radio), sequence.devices(radio)
    vertices, faces = sequence.static_mesh()
    triangles = vertices[faces].astype(np.float64)
    clear = []
    for sample, value in enumerate(static):
        place = layout(spec, devices, sample)
        where = f"{file}: static channel" + (f", sample {sample}" if len(static) > 1 else "")
        if not np.isfinite(value).all():
            yield f"{where}: values that are not finite"
            return
        if not value[place.measured].any():
            yield f"{where}: silent"
            return
        yield from _early_faults(sequence, radio, value, place, where)
        here = devices_at(spec, devices, sample)
        for tx, rx in _clear_links(place, triangles):
            response = _response(spec, place, here, tx[0], rx[0])
            if abs(response) > WEAK_RESPONSE:
                links = value[np.ix_(tx, rx)] / response
                distance_m = np.linalg.norm(place.tx_xyz[tx][:, None] - place.rx_xyz[rx], axis=-1)
                clear.append(_direct_path(sequence, radio, links, distance_m))
    if clear:
        yield from _direct_faults(sequence, radio, file, np.array(clear))


def _early_faults(
    sequence: Sequence, radio: str, static: np.ndarray, layout: Layout, where: str
) -> Iterator[str]:
    """Pairs of devices between which something arrives before light can."""
    for a, b in layout.device_pairs:
        tx, rx = layout.block_of(a, b)
        distance_m = np.linalg.norm(layout.tx_xyz[tx] - layout.rx_xyz[rx], axis=-1)
        early = _early_power(sequence, radio, static[tx, rx], distance_m)
        if early > EARLY_LIMIT:
            yield (
                f"{where}: devices {a} to {b}: {decibels(early):.0f} dB arrive before the "
                "direct path can"
            )


def _direct_faults(sequence: Sequence, radio: str, file: Path, clear: np.ndarray) -> Iterator[str]:
    gain, late_m = np.median(clear[:, 0]), np.median(np.abs(clear[:, 1]))
    cell_m = SPEED_OF_LIGHT / sequence.radio_spec(radio).bandwidth_hz
    if not DIRECT_LIMITS[0] <= gain <= DIRECT_LIMITS[1]:
        yield f"{file}: clear direct paths have {gain:.2f} of their free-space amplitude"
    if late_m > 0.5 * cell_m:
        yield (
            f"{file}: clear direct paths are {late_m:.2f} m from where the geometry puts them, "
            f"more than half a delay cell ({cell_m:.2f} m)"
        )


def _clear_links(layout: Layout, triangles: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Indices of TX and RX elements of one site and port each, where nothing stands between."""
    tx, rx = np.nonzero(layout.measured)
    keys = np.stack(
        [layout.tx_site[tx], layout.rx_site[rx], layout.tx_port[tx], layout.rx_port[rx]], axis=1
    )
    free: dict[tuple[int, int], bool] = {}
    for a, b, i, j in np.unique(keys, axis=0):
        tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == i))
        rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == j))
        if (a, b) not in free:
            start, end = layout.tx_xyz[tx].mean(axis=0), layout.rx_xyz[rx].mean(axis=0)
            free[a, b] = not blocked(start, end, triangles)
        if free[a, b]:
            yield tx, rx


def _response(spec: Radio, layout: Layout, devices: list[DevicePose], tx: int, rx: int) -> float:
    """What both antennas make of the direct path between two elements' sites.

    Patterns, slants and turned devices; 1 for upright isotropic antennas, 0 where a device has
    the other straight above or below it.
    """
    a, b = int(layout.tx_device[tx]), int(layout.rx_device[rx])
    start = layout.tx_xyz[layout.tx_site == layout.tx_site[tx]].mean(axis=0)
    end = layout.rx_xyz[layout.rx_site == layout.rx_site[rx]].mean(axis=0)
    way = (end - start)[None] / np.linalg.norm(end - start)
    axes = rotation(devices[a].quat_wxyz), rotation(devices[b].quat_wxyz)
    if any(np.linalg.norm((way @ turn)[0, :2]) < AXIS_SINE for turn in axes):
        return 0.0
    slants = spec.slants_deg[layout.tx_port[tx]], spec.slants_deg[layout.rx_port[rx]]
    sent, heard = (
        field(spec.pattern, slant, sign * way, turn)
        for slant, sign, turn in zip(slants, (1.0, -1.0), axes, strict=True)
    )
    isolation = amplitude_of(-spec.isolation_db) if a == b else 1.0
    return float((sent * heard).sum()) * isolation


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


def _early_power(
    sequence: Sequence, radio: str, links: np.ndarray, distance_m: np.ndarray
) -> float:
    """Strongest arrival earlier than light allows, relative to the strongest of all.

    A profile repeats every c / subcarrier spacing, so its last third is also negative delay. Where
    phases run backwards the direct path stands there, as far from the end as devices are apart, and
    then everything else. Walls seen by three reflections may stand there too, if they are weak.
    """
    spec = sequence.radio_spec(radio)
    subcarriers = spec.num_subcarriers
    profile = delay_profile(links, hann_to_zero(subcarriers))
    power = (np.abs(profile) ** 2).mean(axis=(0, 1))
    cell_m = SPEED_OF_LIGHT / spec.bandwidth_hz
    length_m = np.arange(subcarriers) * cell_m
    period_m = spec.unambiguous_path_m
    length_m = np.where(length_m > 2.0 / 3.0 * period_m, length_m - period_m, length_m)
    share = np.where(length_m < -(float(distance_m.max()) + cell_m), LATE_SHARE, 1.0)
    early = (power * share)[length_m < float(distance_m.min()) - HANN_LOBE * cell_m]
    return float(early.max() / power.max()) if len(early) else 0.0


def _direct_path(
    sequence: Sequence, radio: str, links: np.ndarray, distance_m: np.ndarray
) -> tuple[float, float]:
    """Amplitude relative to Friis, and length by which the strongest arrival is off [m].

    All elements are aligned with their exact distances first, so the direct path adds up
    coherently and reflections do not.
    """
    spec = sequence.radio_spec(radio)
    wavenumber = 2 * np.pi * spec.freq_hz / SPEED_OF_LIGHT
    window = hann_to_zero(spec.num_subcarriers)
    free_space = np.exp(-1j * wavenumber * distance_m[..., None]) / (
        2 * wavenumber * distance_m[..., None]
    )
    aligned = (links / free_space).mean(axis=(0, 1)) * window
    offset_m = np.linspace(-4, 4, 321) * SPEED_OF_LIGHT / spec.bandwidth_hz
    shift = np.exp(1j * np.outer(offset_m, wavenumber - wavenumber.mean()))
    late_m = offset_m[np.abs(shift @ aligned).argmax()]
    return float(np.abs(aligned.sum()) / window.sum()), float(late_m)


def energy_faults(sequence: Sequence, radio: str, value: np.ndarray, where: str) -> Iterator[str]:
    """Passive scenes bring no more energy than free space, give or take what adds in phase.

    The energy of all links, in the loudest of the samples `value` (sample, tx, rx, subcarrier),
    is compared with that of straight lines of the same lengths, (λ/4πd)², times the antennas'
    peak gains.
    """
    # Antennas that move keep their distance.
    elements, spec = sequence.layout(radio), sequence.radio_spec(radio)
    tx, rx = np.nonzero(elements.measured)
    distance_m = np.linalg.norm(elements.tx_xyz[tx] - elements.rx_xyz[rx], axis=-1)
    wavenumber = 2 * np.pi * spec.freq_hz / SPEED_OF_LIGHT
    free_space = (1.0 / (2 * wavenumber * distance_m[:, None])) ** 2
    gain = PEAK_GAINS.get(spec.pattern, max(PEAK_GAINS.values())) ** 2
    energy = max((np.abs(one[elements.measured]) ** 2).sum() for one in value)
    ratio = float(energy / free_space.sum() / gain)
    if ratio > ENERGY_LIMIT:
        yield f"{where}: {ratio:.1f} times the energy of free space, more than a scene can give"
