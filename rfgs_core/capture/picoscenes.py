# SPDX-License-Identifier: Apache-2.0
"""PicoScenes captures (Jiang et al. 2022), `.csi`: AX200, AX210, QCA9300 and Intel 5300.

One file mixes packets of several formats; each becomes a capture of its own.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Complex64, Int64

from rfgs_core.capture.file_bytes import read_bytes, refuse_too_many, unwrapped_s
from rfgs_core.capture.model import Capture, Reading, reading
from rfgs_core.capture.picoscenes_frames import FORMATS, Frame, frames, is_frame, is_whole_frame
from rfgs_core.capture.wifi_grid import INTEL_5300, SPACING_HZ, occupied, pilots
from rfgs_core.sanitize.gaps import fill_gaps

NAME = "picoscenes"
TITLE = "PicoScenes: AX200, AX210, QCA9300, Intel 5300"
SUFFIXES = (".csi",)

_DEVICES = {0x2000: "AX200", 0x2100: "AX210", 0x9300: "QCA9300", 0x5300: "Intel 5300"}
#: More streams than 802.11 has are a sign of damage.
_MOST_STREAMS = 16


def looks_like(head: bytes, _path: Path) -> bool:
    """Whether a file begins with a frame."""
    return is_frame(head)


def read(path: Path) -> Reading:
    """Reads a capture.

    Returns:
        Channels (time, 1, rx, tx, subcarrier) in the card's own integers, one capture for each
        device, format, width, shape and centre; pilots of AX200 and AX210 are interpolated and not
        `valid`. `packets` holds rssi_dbm, noise_dbm and clock_us.

    Raises:
        RfgsError: The file cannot be read.
        RfgsFormatError: It is empty, too large or holds no packet with a channel.
    """
    return decode(path, read_bytes(path))


def is_record(data: bytes) -> bool:
    """Whether bytes are one whole frame."""
    return is_whole_frame(data)


def decode(path: Path, data: bytes) -> Reading:
    """Reads frames that are at hand; see `read`.

    Args:
        path: Where they are from, for messages.
        data: The frames.

    Raises:
        RfgsFormatError: They hold no packet with a channel, or too many.
    """
    damage: dict[str, int] = {}
    groups: dict[tuple, tuple[list[Frame], list[np.ndarray]]] = {}
    values_so_far = stamp = 0
    for frame in frames(data, damage):
        value = _channel(frame)
        if value is None:
            what = f"packets of {_DEVICES.get(frame.device, hex(frame.device))} that do not decode"
            damage[what] = damage.get(what, 0) + 1
            continue
        values_so_far += value.size
        refuse_too_many(path, values_so_far)
        key = (frame.device, frame.form, frame.width_mhz, frame.centre_mhz, value.shape)
        kept, channels = groups.setdefault(key, ([], []))
        # Later parts of an aggregate carry no clock of their own.
        stamp = frame.clock_us or stamp
        kept.append(replace(frame, clock_us=stamp))
        channels.append(value)
    captures = [_capture(kept, np.stack(channels)) for kept, channels in groups.values()]
    return reading(path, NAME, captures, damage)


def _channel(frame: Frame) -> Complex64[np.ndarray, "rx tx subcarrier"] | None:
    """Decodes one packet; None where its sizes do not fit."""
    if not (1 <= frame.num_tx <= _MOST_STREAMS and 1 <= frame.num_rx <= _MOST_STREAMS):
        return None
    index = _index(frame)
    if index is None or len(index) != frame.count:
        return None
    if frame.device in (0x2000, 0x2100):
        return _intel_ax(frame)
    return _qca9300(frame) if frame.device == 0x9300 else _intel_5300(frame)


def _index(frame: Frame) -> Int64[np.ndarray, "subcarrier"] | None:
    """Numbers of a packet's subcarriers."""
    if frame.device not in _DEVICES or frame.form >= len(FORMATS):
        return None
    if frame.device == 0x5300:
        rows = INTEL_5300.get(frame.width_mhz)
        index = None if rows is None else np.array(rows, np.int64)
    else:
        form = FORMATS[frame.form] if frame.device != 0x9300 else "HT"
        index = occupied(form, frame.width_mhz)
    return None if index is None else index + frame.offset


def _intel_ax(frame: Frame) -> np.ndarray | None:
    """16-bit real and imaginary parts, RX slowest, subcarrier fastest."""
    shape = frame.num_rx, frame.num_tx, frame.count
    if len(frame.payload) != 4 * int(np.prod(shape)):
        return None
    parts = np.frombuffer(frame.payload, "<i2").astype(np.float32)
    return parts.view(np.complex64).reshape(shape)


def _qca9300(frame: Frame) -> np.ndarray | None:
    """Signed 10-bit numbers, imaginary part first; RX fastest, then TX, then subcarrier."""
    streams = len(frame.payload) * 8 // (20 * frame.count * frame.num_rx)
    used = streams * frame.num_rx * frame.count
    if not 1 <= streams <= _MOST_STREAMS:
        return None
    bits = np.unpackbits(np.frombuffer(frame.payload, np.uint8), bitorder="little")[: 20 * used]
    numbers = bits.reshape(-1, 10).astype(np.int32) @ (1 << np.arange(10))
    numbers -= (numbers & 0x200) << 1
    pairs = numbers.reshape(frame.count, streams, frame.num_rx, 2)
    value = (pairs[..., 1] + 1j * pairs[..., 0]).astype(np.complex64)
    return value.transpose(2, 1, 0)


def _intel_5300(frame: Frame) -> np.ndarray | None:
    """Groups of 3 empty bits and signed bytes, antennas by the selection of RX chains."""
    streams = frame.num_tx + frame.num_extra
    used = frame.num_rx * streams
    needed = 30 * (3 + 16 * used)
    bits = np.unpackbits(np.frombuffer(frame.payload, np.uint8), bitorder="little")
    if used < 1 or len(bits) < needed:
        return None
    groups = bits[:needed].reshape(30, 3 + 16 * used)[:, 3:]
    parts = np.packbits(groups.reshape(-1, 8), axis=1, bitorder="little").view(np.int8)
    parts = parts.reshape(30, frame.num_rx, streams, 2).astype(np.float32)
    value = (parts[..., 0] + 1j * parts[..., 1]).astype(np.complex64).transpose(1, 2, 0)
    chains = [(frame.selection >> (2 * chain)) & 3 for chain in range(frame.num_rx)]
    # PicoScenes keeps as many antennas as were used: their order, not their number, counts.
    return value if len(set(chains)) < len(chains) else value[np.argsort(chains)]


def _capture(kept: list[Frame], values: Complex64[np.ndarray, "time rx tx subcarrier"]) -> Capture:
    first = kept[0]
    index = _index(first)
    assert index is not None
    form = "HT" if first.device in (0x9300, 0x5300) else FORMATS[first.form]
    measured = np.ones(len(index), bool)
    if first.device in (0x2000, 0x2100):
        measured = ~np.isin(index - first.offset, pilots(form, first.width_mhz))
        values = fill_gaps(values, measured, index)
    clock = np.array([frame.clock_us & 0x7FFF_FFFF_FFFF_FFFF for frame in kept], np.int64)
    return Capture(
        source=NAME,
        values=values[:, None],
        valid=np.broadcast_to(measured, values.shape).copy()[:, None],
        time_s=unwrapped_s(clock, 32 if (clock < 1 << 32).all() else 62, 1e-6),
        axis="subcarrier",
        bins=index * SPACING_HZ[form],
        index=index,
        centre_hz=first.centre_mhz * 1e6 if first.centre_mhz > 0 else None,
        packets={
            "rssi_dbm": np.array([float(frame.rssi_dbm) for frame in kept]),
            "noise_dbm": np.array([float(frame.noise_dbm) for frame in kept]),
            "clock_us": clock,
        },
        info={
            "bandwidth_mhz": first.width_mhz,
            "format": form,
            "device": _DEVICES[first.device],
        },
    )
