# SPDX-License-Identifier: Apache-2.0
"""Describes a dataset in numbers: what is in it, how strong, how much of it moves."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from rfgs_core.dataset import Dataset, Sequence, open_dataset
from rfgs_core.dataset.impaired_store import has_impaired
from rfgs_core.radio import devices_at
from rfgs_core.radio.delay import delay_profile, hann_to_zero
from rfgs_core.radio.images import SCATTERING
from rfgs_core.radio.levels import decibels, power_of

#: Arrivals weaker than this relative to a link's strongest do not count for its spread [dB].
SPREAD_RANGE_DB = 20.0
#: Cells of the floor that occupancy counts [m].
CELL_M = 0.25


def stats(path: Path, sequence_name: str | None = None) -> dict[str, Any]:
    """Numbers about a dataset, ready for JSON.

    Args:
        path: Folder of the dataset.
        sequence_name: Which sequence; None takes all.

    Raises:
        RfgsError: The dataset or the sequence does not exist, or a file is damaged.
    """
    dataset = open_dataset(path)
    names = dataset.sequences if sequence_name is None else [sequence_name]
    return {
        "has": dataset.has,
        "sequences": {name: _sequence(dataset, dataset.sequence(name)) for name in names},
    }


def _sequence(dataset: Dataset, sequence: Sequence) -> dict[str, Any]:
    found: dict[str, Any] = {
        "frames": len(sequence.frames),
        "first_frame": sequence.frames[0],
        "last_frame": sequence.frames[-1],
        "fps": sequence.fps,
        "duration_s": (sequence.frames[-1] - sequence.frames[0]) / sequence.fps,
        "size_m": (sequence.bounds_m[1] - sequence.bounds_m[0]).round(3).tolist(),
        "cameras": len(sequence.cameras),
        "radios": {radio: radio_stats(sequence, radio) for radio in sequence.radios},
    }
    if "geometry" in dataset.has:
        found["labels"] = _labels(sequence)
    return found


def radio_stats(sequence: Sequence, radio: str) -> dict[str, Any]:
    """Links, levels, share that moves, and delay spread of one radio.

    Levels are |H|² averaged over subcarriers [dB]; the dynamic-to-static ratio is
    Σ|csi − csi_static|² / Σ|csi_static|² over links and subcarriers, its median over frames [dB].
    """
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    # One sample of each frame, or, where antennas move, all of its places.
    static = sequence.csi_static_samples(radio)[:, layout.measured].astype(np.complex128)
    moving, levels = [], []
    for frame in tqdm(sequence.frames, desc=radio, unit="frame"):
        csi = sequence.csi_samples(radio, frame)[: len(static), layout.measured]
        csi = csi.astype(np.complex128)
        moving.append((np.abs(csi - static) ** 2).sum())
        levels.append((np.abs(csi) ** 2).mean(axis=-1).ravel())
    still = (np.abs(static) ** 2).sum()
    level_db = decibels(np.concatenate(levels))
    low, middle, high = np.percentile(level_db, [1, 50, 99])
    spread_ns = 1e9 * delay_spread_s(
        static.reshape(-1, static.shape[-1]), spec.subcarrier_spacing_hz
    )
    found = {
        "devices": len(devices_at(spec, sequence.devices(radio), 0)),
        "tx_elements": len(layout.tx_device),
        "rx_elements": len(layout.rx_device),
        "links": int(layout.measured.sum()),
        "device_pairs": len(layout.device_pairs),
        "subcarriers": spec.num_subcarriers,
        "band_ghz": [spec.freq_min_hz / 1e9, spec.freq_max_hz / 1e9],
        "samples_per_frame": spec.samples_per_frame,
        "trace_depth": sequence.trace_depth(radio),
        "level_db": {"p01": low, "median": middle, "p99": high},
        "dynamic_range_db": high - low,
        # Imported apertures have no empty room.
        "dynamic_to_static_db": decibels(float(np.median(moving) / still)) if still else None,
        "delay_spread_ns": {
            "median": float(np.median(spread_ns)),
            "p90": float(np.percentile(spread_ns, 90)),
            "resolution": 1e9 / spec.bandwidth_hz,
        },
    }
    if has_impaired(sequence.files.csi(radio)):
        found["impaired"] = _impaired(sequence, radio)
    if sequence.files.paths(radio, None).is_file():
        found["paths"] = _paths(sequence, radio)
    return _rounded(found)


def delay_spread_s(links: np.ndarray, spacing_hz: float) -> np.ndarray:
    """RMS delay spread of each link [s]: second central moment of its power delay profile.

    Args:
        links: Channels (link, subcarrier).
        spacing_hz: Distance of subcarriers [Hz].

    Returns:
        (link,); a single path gives the width of the band's own window, below 1/bandwidth.
    """
    subcarriers = links.shape[-1]
    profile = np.abs(delay_profile(links, hann_to_zero(subcarriers))) ** 2
    peak = profile.argmax(axis=-1)
    # A profile is periodic; a quarter of it before the strongest arrival counts as before.
    order = (np.arange(subcarriers) + peak[:, None] - subcarriers // 4) % subcarriers
    profile = np.take_along_axis(profile, order, axis=-1)
    floor = profile.max(axis=-1, keepdims=True) * power_of(-SPREAD_RANGE_DB)
    weight = np.where(profile >= floor, profile, 0.0)
    weight = weight / np.maximum(weight.sum(axis=-1, keepdims=True), 1e-300)
    delay_s = np.arange(subcarriers) / (subcarriers * spacing_hz)
    mean_s = weight @ delay_s
    return np.sqrt(np.maximum(weight @ delay_s**2 - mean_s**2, 0.0))


def _impaired(sequence: Sequence, radio: str) -> dict[str, Any]:
    known, layout = sequence.impairments(radio), sequence.layout(radio)
    received = known.draw.packet_received[:, layout.tx_device[:, None], layout.rx_device]
    return {
        "settings": asdict(known.settings),
        "lost_share": float(1.0 - received[:, layout.measured].mean()),
    }


def _paths(sequence: Sequence, radio: str) -> dict[str, Any]:
    """How many paths a frame has, how many of them by way of people, and how these move."""
    tables = [sequence.paths(radio, frame) for frame in sequence.frames]
    by_people = [(table.kind == SCATTERING).any(axis=1) for table in tables]
    moved_hz = np.concatenate([t.doppler_hz[own] for t, own in zip(tables, by_people, strict=True)])
    return {
        "per_frame": float(np.median([len(table) for table in tables])),
        "by_people_per_frame": float(np.median([own.sum() for own in by_people])),
        "largest_doppler_hz": float(np.abs(moved_hz).max(initial=0.0)),
    }


def _labels(sequence: Sequence) -> dict[str, Any]:
    """Instances, actions, and how far and where on the floor people go."""
    actions: Counter[str] = Counter()
    tracks: dict[int, list[np.ndarray]] = {}
    for frame in sequence.frames:
        actions.update(action or "none" for action in sequence.actions(frame))
        people = zip(sequence.people(frame), sequence.joints(frame), strict=True)
        for person, joints in people:
            if np.isfinite(joints[0]).all():  # NaN where the scene does not tell.
                tracks.setdefault(int(person), []).append(joints[0])
    low, high = sequence.bounds_m[:, :2]
    cells = np.maximum(np.ceil((high - low) / CELL_M), 1)
    visited = {
        tuple(np.floor((point[:2] - low) / CELL_M).astype(int))
        for track in tracks.values()
        for point in track
    }
    return {
        "instances": dict(Counter(row["class"] for row in sequence.instances)),
        "people": len(tracks),
        "actions_frames": dict(sorted(actions.items())),
        "path_m": {str(k): _length_m(track) for k, track in sorted(tracks.items())},
        "floor_visited_share": round(len(visited) / float(cells.prod()), 4),
    }


def _length_m(track: list[np.ndarray]) -> float:
    steps = np.diff(np.stack(track), axis=0)
    return round(float(np.linalg.norm(steps, axis=1).sum()), 3)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return float(f"{value:.5g}") if isinstance(value, float | np.floating) else value
