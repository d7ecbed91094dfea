# SPDX-License-Identifier: Apache-2.0
"""Where the samples of an ESP32's packet belong: which field, which subcarrier, what is empty.

From the tables of Espressif's programming guide, *Wi-Fi Vendor Features*, Channel State
Information: one for the chips up to ESP32-S3 and C3, one for the ESP32-C5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Int64

from rfgs_core.capture.wifi_grid import occupied


class Kind(NamedTuple):
    """What decides where each sample belongs; 0 where a line does not say."""

    channel: int
    second: int
    """Second channel: none, above or below (1, 2)."""
    mode: int
    """non-HT or HT (1)."""
    wide: int
    """Whether the packet is 40 MHz wide."""
    stbc: int
    """Whether a second stream follows."""
    short: bool
    """Whether the line is of a chip since the ESP32-C5 and C6, which tells none of these four."""
    count: int
    """Samples."""


@dataclass(frozen=True)
class Field:
    """A training field within a packet's samples."""

    form: str
    """non-HT, HT or HE."""
    wide: bool
    """Whether it is 40 MHz wide."""
    part: slice
    """Its samples."""
    index: Int64[np.ndarray, "sample"]
    """The subcarrier of each, counted from the middle of both channels where there are two."""
    used: Int64[np.ndarray, "subcarrier"]
    """Subcarriers that carry data or pilots."""


def field_of(kind: Kind, samples: Complex[np.ndarray, "time sample"]) -> Field | None:
    """The HT or HE field of packets where they have one, else the legacy one.

    Args:
        kind: What the lines of the packets say.
        samples: Their samples; on chips since the C5, whose guide and tools disagree about the
            order, the empty ones in the middle of the band tell it.

    Returns:
        None where samples are as many as in no row of the tables.
    """
    return _of_new_chips(kind.count, samples) if kind.short else _of_old_chips(kind)


def _of_old_chips(kind: Kind) -> Field | None:
    """Up to ESP32-S3 and C3: the legacy field, the HT field, and the same of a second stream.

    The legacy field's 64 samples are 0…31, −32…−1, or, with a second channel, 0…63 (below) and
    −64…−1 (above). An HT field has the same ones, of an STBC packet 0…62 and −62…−1; at 40 MHz it
    has 0…63, −64…−1, of an STBC packet 0…60, −60…−1.
    """
    around = _from_zero(31, 32)
    legacy = {1: np.arange(-64, 0), 2: np.arange(64)}.get(kind.second, around)
    shift = {1: -32, 2: 32}.get(kind.second, 0)
    own = Field("non-HT", False, slice(0, 64), legacy, _occupied("non-HT", 20) + shift)
    if kind.mode != 1:
        return own if kind.count >= 64 else None
    if kind.wide:
        index = _from_zero(60, 60) if kind.stbc else _from_zero(63, 64)
        used = _occupied("HT", 40)
    else:
        narrow = {1: np.arange(-62, 0), 2: np.arange(63)} if kind.stbc else {}
        index, used = narrow.get(kind.second, legacy), _occupied("HT", 20) + shift
    if kind.count == 64:
        return own
    # Fields can be turned off, each of its own: without the legacy one the packet begins with HT.
    length = len(index)
    for first in (64, 0):
        if kind.count in (first + length, first + 2 * length):
            return Field("HT", bool(kind.wide), slice(first, first + length), index, used)
    return None


#: Fields of chips since the C5 by their samples: format, width [MHz], farthest subcarrier, and
#: how far the empty ones in the middle reach.
_NEW = {53: ("non-HT", 20, 26, 0), 57: ("HT", 20, 28, 0), 117: ("HT", 40, 58, 1),
        245: ("HE", 20, 122, 1)}  # fmt: skip


def _of_new_chips(count: int, samples: np.ndarray) -> Field | None:
    """Since the ESP32-C5: one field, and the same again of an STBC packet."""
    length = count if count in _NEW else count // 2
    if length not in _NEW or count % length:
        return None
    form, mhz, far, empty = _NEW[length]
    level = np.abs(samples[:, :length]).mean(axis=0)
    rising = np.arange(-far, far + 1)
    middle = level[far - empty : far + empty + 1].mean()
    # From zero on, what is empty below the middle comes last; zero itself is among the spoilt.
    other = level[length - empty :].mean() if empty else 0.5 * np.median(level)
    index = rising if middle < other else _from_zero(far, far)
    return Field(form, mhz == 40, slice(0, length), index, _occupied(form, mhz))


def carries(field: Field) -> Bool[np.ndarray, "sample"]:
    """Which of its samples carry anything: no nulls, nor the first two, which are spoilt."""
    first_two = np.arange(field.part.start, field.part.stop) < 2
    return np.isin(field.index, field.used) & ~first_two


def _from_zero(last: int, first: int) -> Int64[np.ndarray, "sample"]:
    """0…last, −first…−1."""
    return np.concatenate([np.arange(last + 1), np.arange(-first, 0)])


def _occupied(form: str, mhz: int) -> Int64[np.ndarray, "subcarrier"]:
    there = occupied(form, mhz)
    assert there is not None
    return there
