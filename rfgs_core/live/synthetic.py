# SPDX-License-Identifier: Apache-2.0
"""Six receivers that nobody built: a person who walks in a circle, as FeitCSI packets over UDP.

The channel is closed form: Friis' direct path and the echoes of points on an upright cylinder. As
of real cards, every packet has a phase, a timing and a gain of its own, and 16-bit integers.
"""

from __future__ import annotations

import contextlib
import signal
import socket
import struct
import time
from multiprocessing.connection import Connection

import numpy as np
from jaxtyping import Complex64, Complex128, Float64

from rfgs_core.capture.feitcsi import HEADER_BYTES
from rfgs_core.capture.layout_file import CaptureLayout
from rfgs_core.capture.wifi_grid import SPACING_HZ, occupied
from rfgs_core.radio import DevicePose
from rfgs_core.radio.constants import SPEED_OF_LIGHT

BOUNDS_M = ((0.0, 0.0, 0.0), (6.0, 5.0, 2.5))
CENTRE_HZ = 5.775e9
#: VHT packets of 80 MHz on two antennas half a wavelength apart.
FORMAT, WIDTH_MHZ, ANTENNAS = "VHT", 80, 2
_RATE_CODE = 3 << 8 | 2 << 11
_RECEIVERS = (
    *((5.7, 0.3, 1.2), (5.7, 2.5, 2.0), (5.7, 4.7, 1.2)),
    *((3.0, 4.7, 2.0), (0.3, 4.7, 1.2), (0.3, 2.5, 2.0)),
)
#: The person's way: a circle, once in so many seconds.
_CENTRE_M, _RADIUS_M, TURN_S = (3.0, 2.5), 1.0, 6.0
#: Places on the circle whose channels are computed; packets in between take the nearest.
_PLACES = 1200
_POINTS, _BODY_RADIUS_M, _ECHO_M = 60, 0.15, 0.09
_FULL_SCALE, _DELAY_S = 3000.0, 30e-9
#: A packet's phase, timing and gain are drawn from so many.
_VARIANTS = 4


def stand() -> CaptureLayout:
    """One transmitter and six receivers along the walls."""
    upright = (1.0, 0.0, 0.0, 0.0)
    sender = DevicePose("tx", (0.3, 0.3, 1.2), upright, "TRANSMITTER")
    receivers = [
        DevicePose(f"r{row + 1}", place, upright, "RECEIVER")
        for row, place in enumerate(_RECEIVERS)
    ]
    return CaptureLayout(
        devices=(sender, *receivers),
        files=(None,) * 7,
        offsets_s=(0.0,) * 7,
        name="synthetic",
        centre_hz=CENTRE_HZ,
        bounds_m=BOUNDS_M,
    )


def place_m(time_s: float | Float64[np.ndarray, "n"]) -> Float64[np.ndarray, "... 2"]:
    """Where the person is at a time of `time.monotonic` [m]."""
    angle = 2.0 * np.pi * np.asarray(time_s) / TURN_S
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.asarray(_CENTRE_M) + _RADIUS_M * circle


def channels(
    row: int, places: Float64[np.ndarray, "place 2"]
) -> Complex64[np.ndarray, "place rx f"]:
    """Channel of one receiver while the person is at some places.

    Args:
        row: Which receiver.
        places: Where the person stands [m].
    """
    wavelength_m = SPEED_OF_LIGHT / CENTRE_HZ
    sender, receiver = np.array((0.3, 0.3, 1.2)), np.array(_RECEIVERS[row])
    antennas = receiver + np.array([[0, -0.25, 0], [0, 0.25, 0]]) * wavelength_m
    rng = np.random.default_rng(0)
    angle, height = rng.uniform(0, 2 * np.pi, _POINTS), rng.uniform(0.1, 1.7, _POINTS)
    body = np.stack([np.cos(angle), np.sin(angle)], axis=1) * _BODY_RADIUS_M
    direct_m = np.linalg.norm(antennas - sender, axis=1)[:, None]
    direct = _waves(direct_m, wavelength_m / (4 * np.pi * direct_m))
    at_xy = places[:, None] + body
    at = np.concatenate([at_xy, np.broadcast_to(height[:, None], (*at_xy.shape[:2], 1))], axis=2)
    there = np.linalg.norm(at - sender, axis=2)[:, None]
    back = np.linalg.norm(at[:, None] - antennas[:, None], axis=3)
    level = _ECHO_M * wavelength_m / (4 * np.pi * there * back) / np.sqrt(_POINTS)
    return (direct + _waves(there + back, level)).astype(np.complex64)


def _waves(
    path_m: Float64[np.ndarray, "*any point"], level: Float64[np.ndarray, "*any point"]
) -> Complex128[np.ndarray, "*any f"]:
    """Σ level·exp(−j2πf·path/c) over points: sixteen subcarriers on, times up to fifteen more."""
    index = occupied(FORMAT, WIDTH_MHZ)
    assert index is not None
    first, spacing_hz = index[0], SPACING_HZ[FORMAT]
    coarse_hz = CENTRE_HZ + spacing_hz * np.arange(first, index[-1] + 1, 16)
    turn = -2j * np.pi * path_m[..., None] / SPEED_OF_LIGHT
    coarse = level[..., None] * np.exp(turn * coarse_hz)
    fine = np.exp(turn * (spacing_hz * np.arange(16)))
    waves = np.swapaxes(coarse, -1, -2) @ fine
    return waves.reshape(*waves.shape[:-2], -1)[..., index - first]


def record(value: Complex64[np.ndarray, "rx subcarrier"], clock_us: int = 0) -> bytearray:
    """A FeitCSI record of a channel; its clock stands at byte 88."""
    parts = np.stack([value.real, value.imag], axis=-1).round().astype("<i2").tobytes()
    head = bytearray(HEADER_BYTES)
    struct.pack_into("<I", head, 0, len(parts))
    head[46], head[47] = value.shape[0], 1
    struct.pack_into("<III", head, 52, value.shape[1], 0, 50)
    struct.pack_into("<I", head, 64, 50)
    struct.pack_into("<II", head, 88, clock_us, _RATE_CODE)
    return head + parts


def records_of(row: int) -> list[bytearray]:
    """Records of one receiver all along the circle, each with a phase, timing and gain."""
    rng = np.random.default_rng(row + 1)
    times_s = np.arange(_PLACES) * TURN_S / _PLACES
    values = channels(row, place_m(times_s))
    index = occupied(FORMAT, WIDTH_MHZ)
    assert index is not None
    delay_s, phase = rng.uniform(0, _DELAY_S, _VARIANTS), rng.uniform(0, 2 * np.pi, _VARIANTS)
    turn = np.exp(1j * phase[:, None] - 2j * np.pi * index * SPACING_HZ[FORMAT] * delay_s[:, None])
    gain = _FULL_SCALE * rng.uniform(0.5, 1.0, _VARIANTS)[:, None] / np.abs(values).max()
    factor = (gain * turn)[rng.integers(0, _VARIANTS, _PLACES)]
    return [record(value * own) for value, own in zip(values, factor, strict=True)]


def send(pipe: Connection, ports: list[int], per_s: float) -> None:
    """Sends packets of every receiver to a port of loopback, until the other end says stop.

    Args:
        pipe: Is told in the end how many were sent to each port.
        ports: A port for each receiver.
        per_s: Packets of each receiver in a second.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    packets = [records_of(row) for row in range(len(ports))]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own, contextlib.suppress(OSError):
        begin_s, sent = time.monotonic(), 0
        while not pipe.poll():
            due = int((time.monotonic() - begin_s) * per_s)
            for number in range(sent, due):
                now_s = begin_s + number / per_s
                which = int(now_s % TURN_S * _PLACES / TURN_S) % _PLACES
                clock_us = int(now_s * 1e6) & 0xFFFF_FFFF
                for row, port in enumerate(ports):
                    packet = packets[row][which]
                    struct.pack_into("<I", packet, 88, clock_us)
                    own.sendto(packet, ("127.0.0.1", port))
            sent = max(sent, due)
            time.sleep(0.5 / per_s)
        pipe.send(sent)
