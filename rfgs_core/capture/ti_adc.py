# SPDX-License-Identifier: Apache-2.0
"""Raw ADC samples of TI's mmWave radars (DCA1000 or the board's own), `.bin` beside `.yaml`.

The samples are signed 16-bit numbers without any header, so a YAML file of the same name tells
what they are; `SETTINGS` names its fields. Within a chirp each receiver's samples follow one
another, complex ones as `I I Q Q` (two LVDS lanes of xWR16xx, 18xx and 68xx: "Mmwave Radar Device
ADC Raw Data Capture", SWRA581B, section 5) or as `I Q I Q`.

A mixer's output at time t of a chirp of slope S is the conjugate of the channel at f₀ + S t, so
the samples of a chirp are subcarriers; their inverse Fourier transform is the range profile.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.errors import RfgsFormatError
from rfgs_core.yaml_file import read_yaml

NAME = "ti_adc"
TITLE = "TI mmWave radar, raw ADC samples"
SUFFIXES = (".bin",)

#: Fields of the YAML file: whole numbers, then numbers, each with what it is.
SETTINGS = {
    "samples": "complex samples per chirp",
    "rx": "receivers",
    "tx": "transmitters that take turns, chirp by chirp",
    "loops": "turns of all transmitters per frame",
    "order": "iiqq (two LVDS lanes) or iqiq",
    "start_hz": "frequency at the first sample [Hz]",
    "slope_hz_per_s": "slope of the chirp [Hz/s]",
    "sample_rate_hz": "sampling rate [Hz]",
    "chirp_s": "time from chirp to chirp [s]",
    "frame_s": "time from frame to frame [s]",
}
_WHOLE = ("samples", "rx", "tx", "loops")
_ORDERS = ("iiqq", "iqiq")


def looks_like(_head: bytes, path: Path) -> bool:
    """Whether a file of samples has its settings beside it."""
    return path.suffix.lower() in SUFFIXES and path.with_suffix(".yaml").is_file()


def read(path: Path) -> Reading:
    """Reads whole frames.

    Returns:
        Radar cubes (time, 1, rx, tx, sample), a time for each loop of each frame; `bins` the
        chirp's frequency at each sample. Transmitters of a loop are `chirp_s` apart in time.

    Raises:
        RfgsError: The samples or their settings cannot be read.
        RfgsFormatError: A setting is missing or impossible, or there is no whole frame.
    """
    settings = _settings(path.with_suffix(".yaml"))
    data = read_bytes(path)
    shape = tuple(settings[name] for name in ("loops", "tx", "rx", "samples"))
    frame_bytes = 4 * math.prod(shape)
    frames, left = divmod(len(data), frame_bytes)
    refuse_too_many(path, frames * math.prod(shape))
    damage = {"bytes after the last whole frame": left}
    if not frames:
        raise RfgsFormatError(
            f"{path}: expected frames of {frame_bytes} bytes ({' × '.join(map(str, shape))} "
            f"complex samples), found {len(data)} bytes"
        )
    numbers = np.frombuffer(data, "<i2", frames * frame_bytes // 2).astype(np.float32)
    if settings["order"] == "iiqq":
        pairs = numbers.reshape(-1, 2, 2)
        samples = (pairs[:, 0] + 1j * pairs[:, 1]).astype(np.complex64).ravel()
    else:
        samples = numbers.view(np.complex64)
    cube = np.conj(samples).reshape(frames * shape[0], shape[1], shape[2], shape[3])
    values = np.ascontiguousarray(cube.transpose(0, 2, 1, 3))[:, None]
    step_hz = settings["slope_hz_per_s"] / settings["sample_rate_hz"]
    offset_hz = (np.arange(shape[3]) - 0.5 * (shape[3] - 1)) * step_hz
    frame_s = np.arange(frames) * settings["frame_s"]
    loop_s = np.arange(shape[0]) * shape[1] * settings["chirp_s"]
    capture = Capture(
        source=NAME,
        values=values,
        valid=np.ones(values.shape, bool),
        time_s=(frame_s[:, None] + loop_s).ravel(),
        axis="subcarrier",
        bins=offset_hz,
        index=np.arange(shape[3]),
        centre_hz=settings["start_hz"] - offset_hz[0],
        packets={"frame": np.repeat(np.arange(frames), shape[0])},
        info=settings,
    )
    return reading(path, NAME, [capture], damage)


def _settings(path: Path) -> dict[str, Any]:
    """Settings of a file of samples, checked."""
    values = read_yaml(path)
    values = values if isinstance(values, dict) else {}
    missing = [f"{name} ({what})" for name, what in SETTINGS.items() if name not in values]
    if missing:
        raise RfgsFormatError(f"{path}: expected {missing[0]}, found no such field")
    for name in SETTINGS:
        value = values[name]
        if name == "order":
            fits = value in _ORDERS
        elif name in _WHOLE:
            fits = type(value) is int and 1 <= value <= 65536
        else:
            fits = type(value) in (int, float) and 0 < value < 1e16
        if not fits:
            raise RfgsFormatError(f"{path}: {name}: expected {SETTINGS[name]}, got {value!r}")
    if values["order"] == "iiqq" and values["samples"] % 2:
        raise RfgsFormatError(f"{path}: samples: expected an even number with order iiqq")
    if values["frame_s"] < values["loops"] * values["tx"] * values["chirp_s"] * (1 - 1e-9):
        raise RfgsFormatError(f"{path}: frame_s: shorter than its loops × tx chirps of chirp_s")
    return {name: values[name] for name in SETTINGS}
