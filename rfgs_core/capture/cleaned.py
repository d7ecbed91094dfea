# SPDX-License-Identifier: Apache-2.0
"""Sanitisation of a whole capture, step by step in the order that survives review."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rfgs_core import sanitize
from rfgs_core.capture.model import Capture
from rfgs_core.sanitize.clock import common_clock

#: Packets between which the clock of a capture has no ticks are not resampled below this [Hz].
_SLOWEST_HZ = 20.0
_RESAMPLED = "resampled at"


@dataclass(frozen=True)
class Step:
    """One step that was taken, and the capture after it."""

    name: str
    """What was done, in words."""
    capture: Capture
    """The result."""


def steps(capture: Capture) -> Iterator[Step]:
    """Takes every step that a capture allows; what it lacks (gain, pilots, a rate) is left out.

    Filled and cleaned values keep the mask of the capture. After the last step antennas keep
    their phases relative to each other, and packets have no offset of timing and phase.

    Args:
        capture: Channels over subcarriers; of other axes only outliers are replaced.

    Yields:
        Each step with its result, which the next one starts from.
    """
    if capture.info.get("untimed"):
        return  # Each packet is from a place of its own.
    over_subcarriers = capture.axis == "subcarrier" and len(capture.bins) > 1
    values, packets = capture.values, capture.packets
    if "agc_gain" in packets:
        capture = replace(capture, values=sanitize.undo_gain(values, _gain_db(packets)))
        yield Step("gain that the radio reports undone", capture)
    elif capture.source == "intel5300":
        scaled = sanitize.scale_intel5300(
            values[:, 0], packets["rssi_db"], packets["agc_db"], packets["noise_dbm"]
        )
        capture = replace(capture, values=scaled.astype(np.complex64)[:, None])
        yield Step("scaled to the root of the SNR", capture)
    elif over_subcarriers and "rssi_dbm" in packets:
        rssi_dbm = packets["rssi_dbm"].reshape(len(capture), -1).max(axis=1)
        scaled = sanitize.scale_to_rssi(values, rssi_dbm, capture.valid)
        capture = replace(capture, values=scaled.astype(np.complex64))
        yield Step("scaled to RSSI", capture)
    if over_subcarriers:
        yield from _over_subcarriers(capture)
    else:
        cleaned, changed = sanitize.hampel(capture.values)
        yield Step(f"{int(changed.sum())} outliers replaced", replace(capture, values=cleaned))


def _gain_db(packets: Mapping[str, np.ndarray]) -> np.ndarray:
    """Gain of ESP32 chips [dB]: steps of 1 dB of the AGC, of ¼ dB of the FFT's (a signed byte).

    Source: `esp_csi_gain_ctrl` of Espressif's esp-csi.
    """
    gain_db = packets["agc_gain"].astype(np.float64)
    if "fft_gain" in packets:
        gain_db += 0.25 * ((packets["fft_gain"] + 128) % 256 - 128)
    return gain_db


def cleaned(capture: Capture) -> tuple[Capture, list[str]]:
    """A capture after every step but the common clock, at its own packets; and what was done."""
    taken = [step for step in steps(capture) if not step.name.startswith(_RESAMPLED)]
    return (taken[-1].capture if taken else capture), [step.name for step in taken]


def _over_subcarriers(capture: Capture) -> Iterator[Step]:
    """Rotations, gaps, outliers, one clock and linear phase."""
    form, width = str(capture.info.get("format", "")), int(capture.info.get("bandwidth_mhz", 0))
    if form in ("HT", "VHT") and width >= 40 and capture.source not in ("feitcsi", "picoscenes"):
        # Firmware of AX200 and AX210 takes the rotations back itself.
        turned = sanitize.undo_rotations(capture.values, capture.index, form, width)
        capture = replace(capture, values=turned.astype(np.complex64))
        yield Step("rotations of the standard undone", capture)
    # Only then, as phases jump where rotations begin.
    received = capture.valid.any(axis=-1, keepdims=True)
    if (~capture.valid & received).any():
        filled = sanitize.fill_gaps(capture.values, capture.valid, capture.index)
        capture = replace(capture, values=filled.astype(np.complex64))
        yield Step("nulls, pilots and centre filled", capture)
    cleaned, changed = sanitize.hampel(capture.values)
    capture = replace(capture, values=cleaned)
    yield Step(f"{int(changed.sum())} outliers replaced", capture)
    if capture.source == "intel5300":
        whole, turns = sanitize.undo_quarter_turns(capture.values[:, 0])
        capture = replace(capture, values=whole[:, None])
        if turns.any():
            yield Step(f"{np.count_nonzero(turns)} quarter turns of antennas undone", capture)
    straight = np.stack(
        [
            sanitize.remove_linear_phase(capture.values[:, device], capture.index)
            for device in range(capture.values.shape[1])
        ],
        axis=1,
    )
    capture = replace(capture, values=straight)
    yield Step("timing and phase offset removed, one slope per packet", capture)
    rate_hz = min(capture.rate_hz, 2.0 * len(capture) / max(float(capture.time_s[-1]), 1e-9))
    if rate_hz >= _SLOWEST_HZ and len(capture) > 2:
        yield Step(f"{_RESAMPLED} {rate_hz:.0f} Hz", _resampled(capture, rate_hz))


def _resampled(capture: Capture, rate_hz: float) -> Capture:
    """The capture on a clock of its own rate; ticks in gaps are not valid."""
    ticks_s = common_clock([capture.time_s], rate_hz)
    values, trusted = sanitize.resample(capture.values, capture.time_s, ticks_s)
    nearest, _ = sanitize.resample(np.arange(len(capture)), capture.time_s, ticks_s, "nearest")
    kept = capture.select(nearest)
    valid = kept.valid & trusted[:, None, None, None, None]
    return replace(kept, values=values, valid=valid, time_s=ticks_s)


def coherence(capture: Capture) -> float:
    """Mean |correlation| of neighbouring packets over antennas and bins, 1 if phases hold.

    |Σ_k H̄_t(k) H_{t+1}(k)| / Σ|H̄_t||H_{t+1}| summed over packets before the modulus is taken.
    """
    values = capture.values.reshape(len(capture), -1)
    product = np.conj(values[:-1]) * values[1:]
    weight = np.abs(product).sum()
    return float(np.abs(product.sum()) / weight) if weight > 0 else 0.0
