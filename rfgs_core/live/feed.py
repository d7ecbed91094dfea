# SPDX-License-Identifier: Apache-2.0
"""Gaussians through a socket of this machine: whoever connects is sent every update.

A message is a line of JSON, `{"rfgs": 1, "time_s": …, "count": M, "columns": […], "bytes": N}`, and
N bytes: M rows of little-endian float32, a value per column. A reader that is slow misses updates,
never parts of one, and holds nobody up.
"""

from __future__ import annotations

import contextlib
import json
import queue
import socket
import threading

import numpy as np

from rfgs_core.errors import RfgsError
from rfgs_core.fit.frame import FrameState
from rfgs_core.radio.levels import decibels

#: Version of the messages.
VERSION = 1
#: What a row says of a Gaussian: place and size [m], rotation (w first), opacity, power [dB].
COLUMNS = (
    *("x", "y", "z", "scale_0", "scale_1", "scale_2"),
    *("rot_0", "rot_1", "rot_2", "rot_3", "opacity", "rf_power_db"),
)
#: Readers at one time.
MOST_READERS = 8
#: A reader that takes nothing for so long is let go [s].
_PATIENCE_S = 5.0
_LOOPBACK = "127.0.0.1"


def power_db(state: FrameState) -> np.ndarray:
    """Power that each Gaussian reflects [dB], at least -200."""
    gamma = state.gamma.detach().numpy()
    return np.maximum(decibels(np.maximum(np.abs(gamma) ** 2, 1e-20)), -200.0).astype(np.float32)


def message(state: FrameState) -> bytes:
    """An update as it is sent."""
    gaussians = state.gaussians
    rows = np.concatenate(
        [
            gaussians.means.numpy(),
            gaussians.scales.numpy(),
            gaussians.quats.numpy(),
            gaussians.opacities.numpy()[:, None],
            power_db(state)[:, None],
        ],
        axis=1,
    ).astype("<f4")
    data = rows.tobytes()
    head = {"rfgs": VERSION, "time_s": round(state.tracks.time_s, 6), "count": len(rows)}
    head |= {"columns": list(COLUMNS), "bytes": len(data)}
    return json.dumps(head).encode() + b"\n" + data


class Feed:
    """The server; it listens on loopback only."""

    def __init__(self, port: int) -> None:
        """Starts listening.

        Args:
            port: TCP port of 127.0.0.1; 0 takes any free one.

        Raises:
            RfgsError: The port is taken.
        """
        try:
            self._server = socket.create_server((_LOOPBACK, port))
        except (OSError, OverflowError) as error:
            raise RfgsError(
                f"cannot listen at {_LOOPBACK}, TCP port {port} ({error}); choose another "
                "--feed-port (0 takes any free one)"
            ) from error
        self._readers: list[queue.Queue[bytes | None]] = []
        self._lock = threading.Lock()
        threading.Thread(target=self._accept, name="feed", daemon=True).start()

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._server.getsockname()[1]

    def show(self, state: FrameState) -> None:
        """Sends an update to everybody; who has not taken the last one gets this one instead."""
        with self._lock:
            readers = list(self._readers)
        if not readers:
            return
        data = message(state)
        for waiting in readers:
            _replace(waiting, data)

    def close(self) -> None:
        """Lets everybody go."""
        # A thread that accepts is not woken by closing alone.
        with contextlib.suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        with self._lock:
            for waiting in self._readers:
                _replace(waiting, None)

    def _accept(self) -> None:
        while True:
            try:
                reader, _ = self._server.accept()
            except OSError:
                return
            with self._lock:
                if len(self._readers) >= MOST_READERS:
                    reader.close()
                    continue
                waiting: queue.Queue[bytes | None] = queue.Queue(1)
                self._readers.append(waiting)
            reader.settimeout(_PATIENCE_S)
            threading.Thread(target=self._send, args=(reader, waiting), daemon=True).start()

    def _send(self, reader: socket.socket, waiting: queue.Queue[bytes | None]) -> None:
        with reader, contextlib.suppress(OSError):
            while (data := waiting.get()) is not None:
                reader.sendall(data)
        with self._lock:
            self._readers.remove(waiting)


def _replace(waiting: queue.Queue[bytes | None], data: bytes | None) -> None:
    """Puts something into a queue of one, in place of what is in it."""
    with contextlib.suppress(queue.Empty):
        waiting.get_nowait()
    with contextlib.suppress(queue.Full):
        waiting.put_nowait(data)
