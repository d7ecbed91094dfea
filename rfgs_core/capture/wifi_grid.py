# SPDX-License-Identifier: Apache-2.0
"""Subcarriers of Wi-Fi packets: which ones are reported, which are pilots, how far apart they are.

Numbers are those of IEEE 802.11 (17.3.5.10, 19.3.21, 21.3.7 and 27.3.10), 0 at the centre of the
channel; each list is in the order of frequency, as receivers report it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Int64

#: Distance of subcarriers [Hz]: of HE and EHT a quarter of what it was before.
SPACING_HZ: dict[str, float] = {
    "non-HT": 312_500.0,
    "HT": 312_500.0,
    "VHT": 312_500.0,
    "HE": 78_125.0,
    "EHT": 78_125.0,
}

#: Occupied subcarriers by format and bandwidth [MHz], as (first, last) runs.
_RUNS: dict[tuple[str, int], tuple[tuple[int, int], ...]] = {
    ("non-HT", 20): ((-26, -1), (1, 26)),
    ("HT", 20): ((-28, -1), (1, 28)),
    ("HT", 40): ((-58, -2), (2, 58)),
    ("VHT", 80): ((-122, -2), (2, 122)),
    ("VHT", 160): ((-250, -130), (-126, -6), (6, 126), (130, 250)),
    ("HE", 20): ((-122, -2), (2, 122)),
    ("HE", 40): ((-244, -3), (3, 244)),
    ("HE", 80): ((-500, -3), (3, 500)),
    ("HE", 160): ((-1012, -515), (-509, -12), (12, 509), (515, 1012)),
}

_PILOTS: dict[tuple[str, int], tuple[int, ...]] = {
    ("non-HT", 20): (7, 21), ("HT", 20): (7, 21), ("HT", 40): (11, 25, 53),
    ("VHT", 80): (11, 39, 75, 103),
    ("VHT", 160): (25, 53, 89, 117, 139, 167, 203, 231),
    ("HE", 20): (22, 48, 90, 116),
    ("HE", 40): (10, 36, 78, 104, 144, 170, 212, 238),
    ("HE", 80): (24, 92, 158, 226, 266, 334, 400, 468),
    ("HE", 160): (
        *(44, 112, 178, 246, 286, 354, 420, 488), *(536, 604, 670, 738, 778, 846, 912, 980),
    ),
}  # fmt: skip

#: The 30 groups that an Intel 5300 reports, by bandwidth [MHz].
INTEL_5300: dict[int, tuple[int, ...]] = {
    20: (*range(-28, -1, 2), -1, *range(1, 28, 2), 28),
    40: tuple(range(-58, 59, 4)),
}


def occupied(form: str, bandwidth_mhz: int) -> Int64[np.ndarray, "subcarrier"] | None:
    """Numbers of all subcarriers that a packet carries data or pilots on, ascending.

    Args:
        form: Packet format.
        bandwidth_mhz: Width of the packet [MHz].

    Returns:
        None for a combination that the standard does not know or this table does not hold.
    """
    runs = _RUNS.get(_key(form, bandwidth_mhz))
    if runs is None:
        return None
    return np.concatenate([np.arange(first, last + 1) for first, last in runs])


def pilots(form: str, bandwidth_mhz: int) -> Int64[np.ndarray, "pilot"]:
    """Numbers of the pilots, ascending; none where the table does not know the combination."""
    half = np.array(_PILOTS.get(_key(form, bandwidth_mhz), ()), np.int64)
    return np.concatenate([-half[::-1], half])


def channel_hz(number: int, band_ghz: int = 0) -> float | None:
    """Centre of a 20 MHz channel [Hz] (IEEE 802.11, 15.4.4.3, 17.3.8.4 and 27.3.23.2).

    Args:
        number: Channel number.
        band_ghz: 2, 5 or 6; 0 tells by the number, 6 GHz excluded.
    """
    band_ghz = band_ghz or (2 if 1 <= number <= 14 else 5)
    if band_ghz == 2:
        return 2.484e9 if number == 14 else 2.407e9 + 5e6 * number if 1 <= number <= 13 else None
    if band_ghz == 6:
        return 5.95e9 + 5e6 * number if 1 <= number <= 233 else None
    return 5e9 + 5e6 * number if 7 <= number <= 196 else None


def _key(form: str, bandwidth_mhz: int) -> tuple[str, int]:
    """HT and VHT share their narrow formats; EHT's are HE's up to 160 MHz."""
    form = "HE" if form == "EHT" else form
    if form in ("HT", "VHT") and bandwidth_mhz in (20, 40):
        form = "HT"
    return form, bandwidth_mhz
