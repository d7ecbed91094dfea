# SPDX-License-Identifier: Apache-2.0
"""Channels of one device pair over time: amplitude, delay, angle and Doppler."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from dataset_factory.preview.arrays import delay_angle, responses, seen_from
from rfgs_core.dataset import Sequence
from rfgs_core.encode.micro_doppler import micro_doppler
from rfgs_core.radio.levels import decibels

#: Dynamic range of the images [dB].
RANGE_DB = 30.0
#: Dynamic range of spectrograms, in which limbs are weaker than the torso [dB].
DOPPLER_RANGE_DB = 40.0
#: Shorter changes of path length are no movement to choose a pair by [m].
LEAST_TRAVEL_M = 0.5
#: Frames that choose which pair of devices is shown.
TRIAL_FRAMES = 4
#: A Doppler axis that ends below this speed would show a walking person aliased [m/s].
LEAST_SPEED_M_S = 1.0
#: Receiving elements that a spectrogram averages; more only take time.
DOPPLER_ELEMENTS = 4

_TRUTH = {"color": "#4dd2ff", "lw": 1.2, "ls": (0, (4, 2))}


@dataclass(frozen=True)
class Watch:
    """One device pair through the whole sequence."""

    pair: tuple[int, int]
    """Transmitting and receiving device."""
    time_s: np.ndarray
    """Time of every sample [s]."""
    csi: np.ndarray
    """Channels (time, tx, rx, subcarrier) of the pair."""
    static: np.ndarray
    """The same without anything that moves, broadcastable to `csi`."""


def watch(sequence: Sequence, radio: str) -> Watch:
    """Reads the device pair that shows people's movement best."""
    layout = sequence.layout(radio)
    pair = _liveliest(sequence, radio)
    index = layout.block_of(*pair)
    values = [
        sequence.csi_samples(radio, frame)[(slice(None), *index)]
        for frame in tqdm(sequence.frames, desc=f"strips of {radio}", unit="frame")
    ]
    times = [sequence.sample_times_s(radio, frame) for frame in sequence.frames]
    static = sequence.csi_static_samples(radio)[(slice(None), *index)]
    if len(static) > 1:
        static = np.tile(static, (len(sequence.frames), 1, 1, 1))
    return Watch(pair, np.concatenate(times), np.concatenate(values), static)


def _liveliest(sequence: Sequence, radio: str) -> tuple[int, int]:
    """The pair over which people move: through whom the path changes length most.

    Pairs of different devices come first, as a device's own transmitter outshines people. Where
    nobody moves far, the pair whose channel changes most relative to the static one.
    """
    layout = sequence.layout(radio)
    bistatic = [pair for pair in layout.device_pairs if pair[0] != pair[1]] or layout.device_pairs
    travel_m = {pair: _travel_m(sequence, radio, pair) for pair in bistatic}
    best = max(bistatic, key=lambda pair: travel_m[pair])
    if travel_m[best] >= LEAST_TRAVEL_M:
        return best
    static = sequence.csi_static(radio)
    step = max(1, len(sequence.frames) // TRIAL_FRAMES)
    change = [sequence.csi(radio, frame) - static for frame in sequence.frames[::step]]
    share = {}
    for pair in layout.device_pairs:
        index = layout.block_of(*pair)
        moved = sum(float((np.abs(value[index]) ** 2).sum()) for value in change)
        share[pair] = moved / max(float((np.abs(static[index]) ** 2).sum()), 1e-30)
    return max(share, key=lambda pair: share[pair])


def _travel_m(sequence: Sequence, radio: str, pair: tuple[int, int]) -> float:
    """How much the path over the person that moves most changes its length [m]."""
    _, places = _truth(sequence, radio, pair)
    return float(np.ptp(places[..., 1], axis=0).max(initial=0.0))


def _edges(seen: Watch) -> list[tuple[np.ndarray, slice]]:
    """Runs of evenly spaced samples, each with the edges between and around its samples [s]."""
    time = seen.time_s
    if len(time) == 1:
        return [(time[0] + np.array([-0.05, 0.05]), slice(0, 1))]
    step = float(np.median(np.diff(time)))
    cuts = [0, *(np.flatnonzero(np.diff(time) > 1.5 * step) + 1), len(time)]
    return [
        (np.append(time[a:b] - 0.5 * step, time[b - 1] + 0.5 * step), slice(a, b))
        for a, b in itertools.pairwise(cuts)
    ]


def _image(axis: Any, seen: Watch, y: np.ndarray, value: np.ndarray, **style: Any) -> Any:
    """Draws (y, time) with gaps where no sample is."""
    step = y[1] - y[0]
    edges_y = np.append(y - 0.5 * step, y[-1] + 0.5 * step)
    for edges, which in _edges(seen):
        shown = axis.pcolormesh(edges, edges_y, value[:, which], rasterized=True, **style)
    return shown


def amplitude_panel(axis: Any, sequence: Sequence, radio: str, seen: Watch) -> Any:
    """|H| / |H_static| of the liveliest link: what a power-only receiver would notice."""
    ratio_db = decibels(np.abs(seen.csi) ** 2) - decibels(np.abs(seen.static) ** 2)
    # Subcarriers in a deep fade of the empty scene say little, so medians choose link and range.
    lively = np.median(np.abs(ratio_db), axis=(0, 3))
    tx, rx = np.unravel_index(lively.argmax(), lively.shape)
    value = ratio_db[:, tx, rx].T
    most = max(float(np.percentile(np.abs(value), 90)), 0.1)
    axis.set_ylabel("frequency\n[GHz]", fontsize=8)
    freq_ghz = sequence.radio_spec(radio).freq_hz / 1e9
    shown = _image(axis, seen, freq_ghz, value, cmap="RdBu_r", vmin=-most, vmax=most)
    _name(axis, "amplitude against the empty scene [dB]")
    return shown


def delay_panel(axis: Any, sequence: Sequence, radio: str, seen: Watch) -> Any:
    """Delay profile of what people change, with the pelvis' own path length."""
    profile, length_m = responses(sequence, radio, seen.csi - seen.static)
    level = decibels((np.abs(profile) ** 2).mean(axis=(1, 2)).T)
    axis.set_ylabel("path length\n[m]", fontsize=8)
    shown = _image(
        axis, seen, length_m, level, cmap="inferno", vmax=level.max(), vmin=level.max() - RANGE_DB
    )
    times, places = _truth(sequence, radio, seen.pair)
    axis.plot(times, places[..., 1], **_TRUTH)
    _name(axis, "delay of the change [dB]")
    return shown


def angle_panel(axis: Any, sequence: Sequence, radio: str, seen: Watch) -> Any:
    """Angle of arrival of what people change, with the pelvis' own angle."""
    layout = sequence.layout(radio)
    whole = np.zeros((*layout.measured.shape, seen.csi.shape[-1]), np.complex64)
    index = layout.block_of(*seen.pair)
    columns = []
    for value in seen.csi - seen.static:
        whole[index] = value
        power, angle_deg, _ = delay_angle(sequence, radio, whole, seen.pair)
        columns.append(power.sum(axis=1))
    level = decibels(np.stack(columns, axis=1))
    level -= level.max(axis=0)
    axis.set_ylabel("angle\n[°]", fontsize=8)
    shown = _image(
        axis,
        seen,
        angle_deg,
        level,
        cmap="inferno",
        vmax=level.max(),
        vmin=level.max() - 0.5 * RANGE_DB,
    )
    times, places = _truth(sequence, radio, seen.pair)
    axis.plot(times, places[..., 0], **_TRUTH)
    _name(axis, "angle of the change [dB], each moment against its strongest")
    return shown


def doppler_shown(sequence: Sequence, radio: str) -> bool:
    """Whether samples are close enough in time for the speeds of people."""
    spec = sequence.radio_spec(radio)
    times_s = sequence.sample_times_s(radio, sequence.frames[0])
    if len(times_s) < 4:
        return False
    return spec.wavelength_m / (4.0 * (times_s[1] - times_s[0])) >= LEAST_SPEED_M_S


def doppler_panel(axis: Any, sequence: Sequence, radio: str, seen: Watch) -> Any:
    """Micro-Doppler of what people change, with the pelvis' own speed."""
    change = (seen.csi - seen.static)[:, :1, :: max(1, seen.csi.shape[2] // DOPPLER_ELEMENTS)]
    subcarriers = slice(None, None, max(1, change.shape[-1] // 8))
    freq_hz = sequence.radio_spec(radio).freq_hz[subcarriers]
    found = micro_doppler(change[..., subcarriers], seen.time_s, freq_hz)
    level = decibels(found.power)
    shown = axis.pcolormesh(
        found.time_s,
        found.velocity_m_s,
        level,
        shading="nearest",
        cmap="inferno",
        vmin=level.max() - DOPPLER_RANGE_DB,
        vmax=level.max(),
        rasterized=True,
    )
    times_s, places = _truth(sequence, radio, seen.pair)
    if len(times_s) > 1:
        axis.plot(times_s, -0.5 * np.gradient(places[..., 1], times_s, axis=0), **_TRUTH)
    axis.set_ylabel("speed\n[m/s]", fontsize=8)
    fastest = min(3.0, float(found.velocity_m_s[-1]))
    axis.set_ylim(-fastest, fastest)
    _name(axis, "micro-Doppler of the change [dB], positive approaches")
    return shown


def _truth(sequence: Sequence, radio: str, pair: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Angle [°] and path length [m] (frame, person, 2) of each pelvis, and the frames' times."""
    times = np.array([sequence.time_s(frame) for frame in sequence.frames])
    places = [
        [seen_from(sequence, radio, pair, joints[0]) for joints in sequence.joints(frame)]
        for frame in sequence.frames
    ]
    return times, np.array(places).reshape(len(times), -1, 2)


def _name(axis: Any, text: str) -> None:
    box = {"facecolor": "black", "alpha": 0.45, "edgecolor": "none", "pad": 2.0}
    axis.text(
        0.006, 0.93, text, transform=axis.transAxes, color="white", fontsize=7.5, va="top", bbox=box
    )
