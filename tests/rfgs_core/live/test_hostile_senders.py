# SPDX-License-Identifier: Apache-2.0
"""`rfgs live` under senders who want to end it: it counts, goes on, and stays small."""

from __future__ import annotations

import http.client
import os
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from capture_files import feitcsi_record, integers
from sending import free_port, room, send, wait_for
from two_receivers import LAYOUT

from rfgs_core.live.stream import Stream, StreamOptions

ROOT = Path(__file__).resolve().parents[3]
SOUND = feitcsi_record(integers((2, 1, 56), 300), 1)
#: Where a record holds the bytes of its values, its antennas, its subcarriers and its clock.
_SIZE, _RX, _TX, _COUNT, _CLOCK = 0, 46, 47, 52, 88


def changed(record: bytes, place: int, value: int, form: str = "<I") -> bytes:
    made = bytearray(record)
    struct.pack_into(form, made, place, value)
    return bytes(made)


def hostile(state: random.Random) -> Iterator[bytes]:
    """Datagrams without end: junk of every size, and records that lie."""
    silent = feitcsi_record(np.zeros((2, 1, 56), np.complex64), 1)
    loud = feitcsi_record(np.full((2, 1, 56), -32768 - 32768j, np.complex64), 1)
    wider = feitcsi_record(integers((2, 2, 114), 300), 9, width=1)
    while True:
        yield state.randbytes(state.choice((0, 1, 3, 271, 272, 273, 1500, 40_000, 40_001, 65_507)))
        yield changed(SOUND, _SIZE, state.choice((0, 1, 2**31, 2**32 - 1, 448, 452)))
        yield changed(SOUND, state.choice((_RX, _TX)), state.randrange(256), "<B")
        yield changed(SOUND, _COUNT, state.choice((0, 1, 55, 57, 2**31, 2**32 - 1)))
        # Clocks of the past, of the future, and one that stands still.
        for body in (SOUND, silent, loud):
            yield changed(
                body, _CLOCK, state.choice((0, 1, 2**31, 2**32 - 1, state.getrandbits(32)))
            )
        yield wider
        damaged = bytearray(SOUND)
        for _ in range(4):
            damaged[state.randrange(len(damaged))] = state.randrange(256)
        yield bytes(damaged)


@contextmanager
def running(work: Callable[[threading.Event], None]) -> Iterator[None]:
    stop = threading.Event()
    thread = threading.Thread(target=work, args=(stop,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def rss_mb(pid: int) -> float:
    text = Path(f"/proc/{pid}/status").read_text()
    return int(text.split("VmRSS:")[1].split()[0]) / 1024.0


def test_while_a_radio_is_silent_others_fill_no_memory() -> None:
    port = free_port(2)
    state = StreamOptions(port=port, wait_s=3.0, most_per_s=1e5)
    made: list[Stream | str] = []

    def listen() -> None:
        made.append(Stream(room(2), state))

    thread = threading.Thread(target=listen)
    thread.start()
    time.sleep(0.3)
    for start in range(0, 20_000, 500):
        send(port, [changed(SOUND, _CLOCK, 1 + start + row) for row in range(500)])
        time.sleep(0.01)
    send(port + 1, [changed(SOUND, _CLOCK, 1 + row) for row in range(10)])
    thread.join()
    stream = made[0]
    assert isinstance(stream, Stream)
    try:
        wait_for(lambda: stream.counts[0].pushed_out > 5_000)
        assert sum(map(len, stream._early)) < 5_000
    finally:
        stream.close()


@pytest.mark.slow
def test_it_goes_on_whatever_is_sent(tmp_path: Path) -> None:
    (tmp_path / "radios.yaml").write_text(LAYOUT)
    port = free_port(2)
    command = [sys.executable, "-m", "rfgs_core.cli", "live", "--layout"]
    command += [str(tmp_path / "radios.yaml"), "--port", str(port), "--learn-s", "0.5"]
    command += ["--gaussians", "40", "--whole-fit-s", "2", "--view-port", "0", "--feed-port", "0"]

    def radios(stop: threading.Event) -> None:
        while not stop.wait(0.02):
            tick = int(time.monotonic() * 1e6) & 0xFFFF_FFFF
            for row in range(2):
                send(port + row, [changed(SOUND, _CLOCK, tick)])

    def adversary(stop: threading.Event) -> None:
        state, source = random.Random(5), hostile(random.Random(7))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            while not stop.wait(0.005):
                for _ in range(state.choice((1, 20, 200))):
                    own.sendto(next(source), ("127.0.0.1", port + state.randrange(2)))

    with running(radios):
        program = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert program.stdout is not None
        program.stdout.readline()
        where = program.stdout.readline().split()[0]
        time.sleep(4.0)
        before_mb = rss_mb(program.pid)
        with running(adversary):
            sizes = []
            for _ in range(20):
                time.sleep(1.0)
                assert program.poll() is None, program.communicate()[1]
                sizes.append(rss_mb(program.pid))
            statuses = [asked(where, *row) for row in PAGES]
        time.sleep(2.0)
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=60)
    sys.stdout.write(f"{before_mb:.0f} MB, then {sizes}\n{out}{err}")
    assert program.returncode == 0 and "Traceback" not in err
    assert max(sizes) < before_mb + 150.0
    assert statuses == [200, 403, 403, 403]
    for word in ("malformed", "too large", "duplicate", "other format"):
        assert re.search(rf"[1-9]\d* {word}", out), word
    updates = re.search(r"(\d+) updates", out)
    assert updates and int(updates[1]) > 50


#: Host, Origin and whether the token is given: ours, then three that are foreign.
PAGES = [
    (None, None, True), ("evil.example", None, True), (None, "http://evil.example", True),
    (None, None, False),
]  # fmt: skip


def asked(where: str, host: str | None, origin: str | None, token: bool) -> int:
    """Status of the page."""
    found = re.fullmatch(r"http://([\d.]+):(\d+)(/.*)", where)
    assert found
    connection = http.client.HTTPConnection(found[1], int(found[2]), timeout=20)
    connection.putrequest("GET", found[3] if token else "/", skip_host=True)
    connection.putheader("Host", host or f"{found[1]}:{found[2]}")
    if origin:
        connection.putheader("Origin", origin)
    connection.endheaders()
    status = connection.getresponse().status
    connection.close()
    return status
