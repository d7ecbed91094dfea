# SPDX-License-Identifier: Apache-2.0
"""DW1000: distance by the first path of impulse responses, against surveyed places.

The module's distance follows from where its leading-edge detection puts the first path, about
half way up the first pulse. Ours begins where the response first rises out of the noise: nothing
arrives before, and a first path that is weaker than what follows is not passed over (Decawave's
APS006, part 3, looks for such early paths). Only one end of the exchange is logged, so the other
is taken to see the same channel, which it does by reciprocity: the distance shifts by the mean
difference of both edges. Where a pulse "begins" is a convention that calibration absorbs, and one
link cannot tell a convention from a bias; `half_height` shows how much is convention.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from rfgs_core.capture import Capture, read_capture
from rfgs_core.capture.dw1000 import TAP_S
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio.constants import SPEED_OF_LIGHT

#: The response counts as risen at so many times the noise.
_NOISE_FACTOR = 6.0
#: Taps before the module's first path in which it is looked for, and samples per tap.
_BEFORE, _AFTER, _FINER = 12, 4, 16


def judge_ranging(path: Path) -> dict[str, float | str]:
    """Range error [m] of the module and of ours; places stand in tables beside the log.

    Returns:
        Mean absolute error and standard deviation of each, and the surveyed distance.
    """
    capture = read_capture(path).largest
    true_m = surveyed_m(path)
    told = np.isfinite(capture.packets["distance_m"])
    if not told.any():
        raise RfgsFormatError(f"{path}: expected distances of the module, found none")
    result: dict[str, float | str] = {"surveyed_m": true_m, "exchanges": float(told.sum())}
    module_m = capture.packets["distance_m"][told]
    ranges = {"module": module_m}
    for name, edge in (("half_height", _half_height), ("ours", _rise)):
        shift = capture.packets["first_path_tap"] - edges(capture, edge)
        # A distance follows from this reception and the one before it.
        pairs = np.array([shift[max(row - 1, 0) : row + 1].mean() for row in np.flatnonzero(told)])
        ranges[name] = module_m - pairs * TAP_S * SPEED_OF_LIGHT
    for name, found in ranges.items():
        result[f"{name}_error_m"] = float(np.abs(found - true_m).mean())
        result[f"{name}_deviation_m"] = float(found.std())
    return result


def edges(capture: Capture, edge) -> Float[np.ndarray, "time"]:
    """Place of the first path in each response [tap]."""
    found = np.zeros(len(capture))
    for row, response in enumerate(capture.values[:, 0, 0, 0]):
        first = capture.packets["first_path_tap"][row]
        begin = int(np.clip(int(first) - _BEFORE, 0, len(response) - _BEFORE - _AFTER - 1))
        noise = float(np.sqrt(np.mean(np.abs(response[: max(begin - 20, 20)]) ** 2)))
        tap, level = _finer(response, begin, _BEFORE + _AFTER)
        found[row] = edge(tap, level, noise)
    return found


def surveyed_m(path: Path) -> float:
    """Distance of the two ends of a log by `pairs.csv`, `anchors.csv` and `tags.csv` beside it.

    Raises:
        RfgsError: A table is missing, or does not name the log.
    """
    tables = {name: _table(path.with_name(f"{name}.csv")) for name in ("pairs", "anchors", "tags")}
    try:
        anchor, tag = tables["pairs"][path.stem]
        one, two = tables["anchors"][anchor], tables["tags"][tag]
        return float(np.hypot(float(one[0]) - float(two[0]), float(one[1]) - float(two[1])))
    except (KeyError, ValueError, IndexError) as error:
        raise RfgsFormatError(f"{path}: its places are not in the tables beside it") from error


def _table(path: Path) -> dict[str, list[str]]:
    """Rows of a table by their first column."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            return {row[0]: row[1:] for row in csv.reader(stream) if row}
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RfgsError(f"{path}: cannot be read ({error}); it tells surveyed places") from error


def _finer(
    response: Complex[np.ndarray, "tap"], begin: int, count: int
) -> tuple[Float[np.ndarray, "sample"], Float[np.ndarray, "sample"]]:
    """Taps and amplitudes between them: the response is band-limited."""
    from scipy.signal import resample

    margin = 32
    low = max(begin - margin, 0)
    part = response[low : begin + count + margin]
    fine = np.abs(np.asarray(resample(part, len(part) * _FINER)))
    tap = low + np.arange(len(fine)) / _FINER
    inside = (tap >= begin) & (tap < begin + count)
    return tap[inside], fine[inside]


def _rise(tap: np.ndarray, level: np.ndarray, noise: float) -> float:
    """Where a response first rises out of the noise for good."""
    peak = _first_peak(level, noise)
    below = np.flatnonzero(level[:peak] < _NOISE_FACTOR * noise)
    return float(tap[below[-1] + 1 if len(below) else 0])


def _half_height(tap: np.ndarray, level: np.ndarray, noise: float) -> float:
    """Where the first pulse is half as high as at its top."""
    peak = _first_peak(level, noise)
    below = np.flatnonzero(level[:peak] < 0.5 * level[peak])
    return float(tap[below[-1] + 1 if len(below) else 0])


def _first_peak(level: np.ndarray, noise: float) -> int:
    """First maximum that stands a quarter as high as the highest, and out of the noise."""
    high = max(0.25 * float(level.max()), 2 * _NOISE_FACTOR * noise)
    middle = level[1:-1]
    peaks = np.flatnonzero((middle >= level[:-2]) & (middle > level[2:]) & (middle > high)) + 1
    return int(peaks[0]) if len(peaks) else int(level.argmax())
