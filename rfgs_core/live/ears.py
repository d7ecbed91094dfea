# SPDX-License-Identifier: Apache-2.0
"""Sockets that hear datagrams: one for each receiving radio, with limits on everything.

Who sends faster than allowed, or larger than allowed, is not heard; what is not fetched in time is
pushed out by what is newer, so that memory is bounded and the newest packets count. All of it is
counted, and so is what the system dropped before the program read it.
"""

from __future__ import annotations

import errno
import selectors
import socket
import struct
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from rfgs_core.errors import RfgsError
from rfgs_core.live.counts import Counts

#: Larger datagrams are not taken; a packet of 160 MHz and 2 x 2 antennas has 32 KiB [bytes].
LARGEST_BYTES = 40_000
#: Packets that wait for a device at most, and their bytes.
MOST_WAITING, MOST_WAITING_BYTES = 4096, 32 * 2**20
#: A device may send so much of a second's packets at once [s].
_BURST_S = 0.25
#: Datagrams that are read of one socket before the next one has its turn.
_TURN = 64
#: Bytes that the system is asked to hold for a socket; it may give less.
_SYSTEM_BYTES = 4 * 2**20
#: Linux: the number of dropped datagrams beside each one (socket(7), SO_RXQ_OVFL).
_DROPS = 40 if sys.platform == "linux" else None

Datagram = tuple[float, bytes]


class Ears:
    """Datagrams of several radios, from the moment it is made until it is closed."""

    def __init__(
        self,
        host: str,
        ports: Sequence[int],
        is_record: Callable[[bytes], bool],
        most_per_s: float,
    ) -> None:
        """Starts listening.

        Args:
            host: Address to listen at; 127.0.0.1 hears this machine only.
            ports: A port for each radio; 0 takes any free one.
            is_record: Whether a datagram is one whole record.
            most_per_s: Packets of a radio in a second, at most.

        Raises:
            RfgsError: The address is none of this machine's, or a port is taken.
        """
        self.counts = [Counts() for _ in ports]
        self._is_record, self._most_per_s = is_record, most_per_s
        self._allowed = [(most_per_s * _BURST_S, time.monotonic()) for _ in ports]
        self._waiting: list[deque[Datagram]] = [deque() for _ in ports]
        self._bytes = [0 for _ in ports]
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._sockets: list[socket.socket] = []
        try:
            for port in ports:
                self._sockets.append(_listening(host, port))
        except RfgsError:
            self.close()
            raise
        self._thread = threading.Thread(target=self._listen, name="ears", daemon=True)
        self._thread.start()

    @property
    def ports(self) -> list[int]:
        """Where it listens."""
        return [each.getsockname()[1] for each in self._sockets]

    def fetch(self, radio: int) -> list[Datagram]:
        """When datagrams of a radio arrived (`time.monotonic`) and what they hold, oldest first."""
        with self._lock:
            waiting, self._waiting[radio] = self._waiting[radio], deque()
            self._bytes[radio] = 0
        return list(waiting)

    def close(self) -> None:
        """Stops listening; what was not fetched is forgotten."""
        self._stop.set()
        if hasattr(self, "_thread"):
            self._thread.join()
        for each in self._sockets:
            each.close()

    def _listen(self) -> None:
        with selectors.DefaultSelector() as selector:
            for radio, each in enumerate(self._sockets):
                selector.register(each, selectors.EVENT_READ, radio)
            while not self._stop.is_set():
                for key, _ in selector.select(timeout=0.1):
                    self._read(self._sockets[key.data], key.data)

    def _read(self, own: socket.socket, radio: int) -> None:
        """Reads what has come, but not so much that the others wait."""
        for _ in range(_TURN):
            try:
                data, beside, flags, _ = own.recvmsg(LARGEST_BYTES, socket.CMSG_SPACE(4))
            except OSError as error:
                # Nothing is left, or the system tells of an earlier fault of the network.
                if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK, errno.EBADF):
                    return
                continue
            for level, kind, value in beside:
                if (level, kind) == (socket.SOL_SOCKET, _DROPS):
                    self.counts[radio].before_us = struct.unpack("=I", value[:4])[0]
            self._hear(radio, data, cut=bool(flags & socket.MSG_TRUNC))

    def _hear(self, radio: int, data: bytes, *, cut: bool) -> None:
        counts, now_s = self.counts[radio], time.monotonic()
        counts.received += 1
        if cut:
            counts.too_large += 1
        elif not self._may_send(radio, now_s):
            counts.too_many += 1
        elif not self._is_record(data):
            counts.malformed += 1
        else:
            with self._lock:
                waiting = self._waiting[radio]
                waiting.append((now_s, data))
                self._bytes[radio] += len(data)
                while len(waiting) > MOST_WAITING or self._bytes[radio] > MOST_WAITING_BYTES:
                    self._bytes[radio] -= len(waiting.popleft()[1])
                    counts.pushed_out += 1

    def _may_send(self, radio: int, now_s: float) -> bool:
        """Whether a radio keeps to its rate: a bucket that fills by packets per second."""
        left, before_s = self._allowed[radio]
        left = min(left + (now_s - before_s) * self._most_per_s, self._most_per_s * _BURST_S)
        self._allowed[radio] = (left - 1.0 if left >= 1.0 else left), now_s
        return left >= 1.0


def _listening(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise RfgsError(f"--port {port}: expected 0 to 65535, with room for one port per radio")
    try:
        family, kind, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        own = socket.socket(family, kind)
    except OSError as error:
        raise RfgsError(f"--host {host}: not an address ({error.strerror})") from error
    try:
        own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SYSTEM_BYTES)
        if _DROPS is not None:
            own.setsockopt(socket.SOL_SOCKET, _DROPS, 1)
        own.setblocking(False)
        own.bind(place)
    except OSError as error:
        own.close()
        raise RfgsError(
            f"cannot listen at {host}, UDP port {port} ({error.strerror}); choose another --port, "
            "or --host 127.0.0.1 for this machine only"
        ) from error
    return own
