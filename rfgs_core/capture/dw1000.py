# SPDX-License-Identifier: Apache-2.0
"""DW1000 impulse responses, text logs of Decawave's DecaRanging, `.log`.

Each reception writes its time, a line of diagnostics and the accumulator: 1016 taps (992 at 16
MHz mean PRF) of half a chip, 1/(2 · 499.2 MHz) = 1.0016 ns, as `real, imaginary` (DW1000 User
Manual 2.12, 7.2.38). `HLP` is where the chip's leading-edge detection puts the first path, in
taps; after every second reception of a two-way exchange the log tells the distance it measured.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.model import Capture, Reading, reading

NAME = "dw1000"
TITLE = "DW1000 UWB, DecaRanging log"
SUFFIXES = (".log",)

#: Time of a tap [s].
TAP_S = 1.0 / (2 * 499.2e6)
#: Tick of the chip's clock [s]; it wraps after 2⁴⁰ of them, 17.2 s.
TICK_S = TAP_S / 64
#: Centre of each channel [Hz] (IEEE 802.15.4-2011, table 100).
_CENTRES_HZ = {1: 3494.4e6, 2: 3993.6e6, 3: 4492.8e6, 4: 3993.6e6, 5: 6489.6e6, 7: 6489.6e6}

_NUMBER = rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_EVENT = re.compile(
    rb"(?P<time>Rx time = (?P<time_s>" + _NUMBER + rb"))"
    rb"|(?P<ok>RX OK WInd\((?P<window>\d+)\), HLP\((?P<first>" + _NUMBER + rb")\)[^\r\n]*?"
    rb"RSL\((?P<rsl>" + _NUMBER + rb")\), FSL\((?P<fsl>" + _NUMBER + rb")\))"
    rb"|(?P<bad>RX E)"
    rb"|(?P<taps>Accum Len (?P<count>\d+))"
    rb"|(?P<range>ToF: (?P<tof>" + _NUMBER + rb") ns Dist: (?P<dist>" + _NUMBER + rb") m)"
)
_TAP = re.compile(rb"\s*(-?\d{1,6}), ?(-?\d{1,6})[ \t]*\r?\n?")
_MODE = re.compile(rb"Chan (\d+), Code (\d+), PRF (\d+), Plength (\d+)")
_MOST_TAPS = 1016


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file is such a log."""
    return b"DecaRanging" in head or (b"RX OK WInd(" in head and b"Accum Len" in head)


def read(path: Path) -> Reading:
    """Reads a log.

    Returns:
        Impulse responses (time, 1, 1, 1, tap), `bins` the delay [s] of each tap after the first
        one of the accumulator. `packets` holds first_path_tap, rsl_dbm, fsl_dbm (power of the
        signal and of its first path) and distance_m, the module's own, NaN where it told none.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no impulse response.
    """
    data = read_bytes(path)
    mode = _MODE.search(data)
    rows, damage = _receptions(path, data)
    captures = []
    for count in sorted({len(row["taps"]) for row in rows}):
        kept = [row for row in rows if len(row["taps"]) == count]
        captures.append(_capture(kept, mode))
    return reading(path, NAME, captures, damage)


def _receptions(path: Path, data: bytes) -> tuple[list[dict], dict[str, int]]:
    """Whole receptions, and how many were not whole."""
    rows: list[dict] = []
    damage = {"receptions that the chip rejected": 0, "impulse responses cut off or damaged": 0}
    now: dict[str, float] = {}
    for event in _EVENT.finditer(data):
        if event["time"]:
            now["time_s"] = min(max(float(event["time_s"]), 0.0), 1e6)
        elif event["ok"]:
            now["first_path_tap"] = float(event["first"])
            now["rsl_dbm"], now["fsl_dbm"] = float(event["rsl"]), float(event["fsl"])
        elif event["bad"]:
            now = {"rejected": 1.0}
        elif event["range"]:
            if rows:
                rows[-1]["distance_m"] = float(event["dist"])
        else:
            taps = _taps(data, event.end(), int(event["count"]))
            if taps is not None and "rejected" in now:
                damage["receptions that the chip rejected"] += 1
            elif taps is None or "first_path_tap" not in now or "time_s" not in now:
                damage["impulse responses cut off or damaged"] += 1
            else:
                rows.append({**now, "taps": taps, "distance_m": np.nan})
                refuse_too_many(path, len(rows) * _MOST_TAPS)
            now = {}
    return rows, damage


def _taps(data: bytes, start: int, count: int) -> np.ndarray | None:
    """The accumulator's taps, None where they are not all there."""
    if not 1 <= count <= _MOST_TAPS:
        return None
    numbers, at = np.zeros((count, 2), np.float32), start
    for tap in range(count):
        match = _TAP.match(data, at)
        if match is None:
            return None
        numbers[tap] = int(match[1]), int(match[2])
        at = match.end()
    return numbers.view(np.complex64)[:, 0]


def _capture(rows: list[dict], mode: re.Match[bytes] | None) -> Capture:
    values = np.stack([row["taps"] for row in rows])[:, None, None, None]
    names = ("first_path_tap", "rsl_dbm", "fsl_dbm", "distance_m")
    ticks = np.array([round(row["time_s"] / TICK_S) & (2**40 - 1) for row in rows], np.int64)
    index = np.arange(values.shape[-1])
    settings = [int(part) for part in mode.groups()] if mode else [0, 0, 0, 0]
    return Capture(
        source=NAME,
        values=values,
        valid=np.ones(values.shape, bool),
        time_s=unwrapped_s(ticks, 40, TICK_S),
        axis="delay",
        bins=index * TAP_S,
        index=index,
        centre_hz=_CENTRES_HZ.get(settings[0]),
        packets={name: np.array([row[name] for row in rows]) for name in names},
        info={"channel": settings[0], "prf_mhz": settings[2], "preamble": settings[3]},
    )
