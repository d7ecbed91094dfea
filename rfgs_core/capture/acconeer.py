# SPDX-License-Identifier: Apache-2.0
"""Acconeer A121 radar at 60 GHz, recordings of its Exploration Tool, `.h5`.

`sessions/session_S/group_G/entry_E` holds `metadata` (JSON), the sensor's number and
`result/frame`, signed 16-bit I and Q (frame, sweep, point), with `tick` and `temperature`;
`session_config` (JSON) tells each subsweep's first point, step and profile. A point is
`base_step_length_m`, about 2.5 mm of range.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core.capture.file_bytes import refuse_too_many
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.table_file import read_tables
from rfgs_core.errors import RfgsFormatError

NAME = "acconeer"
TITLE = "Acconeer A121 radar"
SUFFIXES = (".h5", ".hdf5")

#: Carrier of the A121 [Hz].
CARRIER_HZ = 60.5e9
_MAGIC = b"\x89HDF\r\n\x1a\n"
#: Range of a point where the metadata does not say [m].
_STEP_M = 2.5e-3


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file is HDF5; what is in it shows when it is read."""
    return head.startswith(_MAGIC)


def read(path: Path) -> Reading:
    """Reads a recording, one capture for each entry (sensor) of each session.

    Returns:
        Radar cubes (time, 1, 1, 1, point), each sweep of a frame a time of its own; `bins` the
        range [m] of each point. `packets` holds frame, sweep and temperature_c; `info` the frame
        rate, sweeps per frame, and of each point its profile and its subsweep (segment). Points of
        overlapping subsweeps stand in the order of range.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is damaged, too large or no such recording.
    """
    tables = read_tables(path, "hdf5")
    entries = sorted(name.removesuffix("/result/frame") for name in tables if _is_frame(name))
    if not entries:
        raise RfgsFormatError(f"{path}: expected sessions/…/result/frame of an A121 recording")
    damage: dict[str, int] = {"entries whose settings do not fit their frames": 0}
    captures = []
    for entry in entries:
        capture = _entry(path, tables, entry)
        if capture is None:
            damage["entries whose settings do not fit their frames"] += 1
        else:
            captures.append(capture)
    return reading(path, NAME, captures, damage)


def _is_frame(name: str) -> bool:
    return name.startswith("sessions/session_") and name.endswith("/result/frame")


def _entry(path: Path, tables: dict[str, np.ndarray], entry: str) -> Capture | None:
    frame = tables[f"{entry}/result/frame"]
    metadata = _json(tables, f"{entry}/metadata")
    config = _json(tables, "/".join(entry.split("/")[:2]) + "/session_config")
    server = _json(tables, "server_info")
    place = [int(part.rpartition("_")[2]) for part in entry.split("/")[2:]]
    try:
        sensors = config["groups"][place[0]]
        settings = list(sensors.values())[place[1]]
        subsweeps = settings["subsweeps"]
        points = [
            row["start_point"] + row["step_length"] * np.arange(row["num_points"])
            for row in subsweeps
        ]
        profiles = [[row["profile"].rpartition("_")[2]] * row["num_points"] for row in subsweeps]
        step_m = float(metadata.get("base_step_length_m", _STEP_M))
        rate_hz = float(settings.get("frame_rate") or config.get("update_rate") or 0.0)
        ticks_hz = float(server.get("ticks_per_second", 0))
        sweep_hz = float(settings.get("sweep_rate") or metadata.get("max_sweep_rate") or 0.0)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, MemoryError):
        return None
    index = np.concatenate(points) if points else np.zeros(0, np.int64)
    if frame.ndim != 3 or frame.dtype != np.complex64 or frame.shape[2] != len(index):
        return None
    if index.dtype.kind != "i" or not (frame.size and 0.0 < step_m < 1.0):
        return None
    refuse_too_many(path, frame.size)
    order = np.argsort(index, kind="stable")
    counts = [len(row) for row in points]
    frames, sweeps, _ = frame.shape
    values = frame[:, :, order].reshape(frames * sweeps, 1, 1, 1, -1)
    time_s = _frame_times_s(tables.get(f"{entry}/result/tick"), frames, ticks_hz, rate_hz)
    within_s = np.arange(sweeps) / sweep_hz if sweep_hz > 0 else np.zeros(sweeps)
    temperature = tables.get(f"{entry}/result/temperature", np.full(frames, np.nan))
    return Capture(
        source=NAME,
        values=np.ascontiguousarray(values),
        valid=np.ones(values.shape, bool),
        time_s=np.maximum.accumulate((time_s[:, None] + within_s).ravel()),
        axis="range",
        bins=index[order] * step_m,
        index=index[order].astype(np.int64),
        centre_hz=CARRIER_HZ,
        packets={
            "frame": np.repeat(np.arange(frames), sweeps),
            "sweep": np.tile(np.arange(sweeps), frames),
            "temperature_c": np.repeat(np.resize(temperature, frames).astype(float), sweeps),
        },
        info={
            "sweeps_per_frame": sweeps,
            "frame_rate_hz": rate_hz,
            "profile": [np.concatenate(profiles)[k] for k in order],
            "segment": [int(np.repeat(np.arange(len(points)), counts)[k]) for k in order],
            "entry": entry,
        },
    )


def _frame_times_s(
    ticks: np.ndarray | None, frames: int, ticks_hz: float, rate_hz: float
) -> np.ndarray:
    """Time of each frame since the first: by the server's clock, else by the rate asked for."""
    if ticks is not None and ticks.shape == (frames,) and ticks_hz > 0:
        return np.maximum.accumulate((ticks - ticks[0]) / ticks_hz)
    return np.arange(frames) / rate_hz if rate_hz > 0 else np.zeros(frames)


def _json(tables: dict[str, np.ndarray], name: str) -> dict[str, Any]:
    """A JSON object stored as text; empty where there is none."""
    try:
        value = json.loads(str(tables[name]))
    except (KeyError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}
