# SPDX-License-Identifier: Apache-2.0
"""Datagrams over the real loopback, and packets of every kind of stream."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from capture_files import (
    ESP_HEADER,
    esp32_file,
    feitcsi_record,
    integers,
    parts,
    picoscenes_frame,
)

from rfgs_core.capture.layout_file import CaptureLayout
from rfgs_core.radio import DevicePose


def send(port: int, datagrams: Iterable[bytes]) -> None:
    """Sends datagrams to a port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        for data in datagrams:
            own.sendto(data, ("127.0.0.1", port))


def wait_for(what: Callable[[], bool], limit_s: float = 20.0) -> None:
    """Waits until something holds."""
    end_s = time.monotonic() + limit_s
    while not what():
        assert time.monotonic() < end_s, "it never came to be"
        time.sleep(0.005)


@contextmanager
def busy_port() -> Any:
    """A UDP port that somebody listens at."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(("127.0.0.1", 0))
        yield own.getsockname()[1]


def free_port(count: int = 1) -> int:
    """First of some consecutive UDP ports that are free now."""
    from rfgs_core.live.bench import free_ports

    return free_ports(count)[0]


def room(receivers: int = 2) -> CaptureLayout:
    """A transmitter and receivers in a room."""
    upright = (1.0, 0.0, 0.0, 0.0)
    places = [(3.0, 0.0, 1.2), (0.0, 3.0, 1.2), (3.0, 3.0, 1.2)][:receivers]
    devices = [DevicePose("tx", (0.0, 0.0, 1.2), upright, "TRANSMITTER")]
    devices += [DevicePose(f"r{n + 1}", at, upright, "RECEIVER") for n, at in enumerate(places)]
    return CaptureLayout(
        tuple(devices), (None,) * len(devices), (0.0,) * len(devices), centre_hz=5.5e9
    )


def feitcsi_stream(packets: int, first: int = 0) -> tuple[list[bytes], np.ndarray]:
    """HT packets of an AX210, a millisecond apart."""
    value = integers((packets, 2, 1, 56), 300)
    ticks = 1_000_000 + 1000 * (first + np.arange(packets))
    rows = zip(value, ticks, strict=True)
    return [feitcsi_record(own, int(tick)) for own, tick in rows], value


def picoscenes_stream(packets: int) -> tuple[list[bytes], np.ndarray]:
    """HT packets of an AX200."""
    value = integers((packets, 2, 1, 56), 300)
    frames = [
        picoscenes_frame(parts(own, "<i2"), (2, 1, 56), clock_us=5000 + 1000 * number)
        for number, own in enumerate(value)
    ]
    return frames, value


def esp32_stream(packets: int, folder: Path) -> list[bytes]:
    """Lines of an ESP32."""
    esp32_file(folder / "a.csv", packets)
    text = (folder / "a.csv").read_text()
    return [line.encode() for line in text.removeprefix(ESP_HEADER).splitlines()]
