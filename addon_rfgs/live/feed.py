# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the updates of `rfgs live --feed-port`, without ever waiting for them.

A message is a line of JSON, `{"rfgs": 1, "time_s": …, "count": M, "columns": […], "bytes": N}`, and
N bytes: M rows of little-endian float32, a value per column.
"""

from __future__ import annotations

import math
import socket
from dataclasses import dataclass

import numpy as np

from ..errors import AddonError
from ..gaussians.splats import FARTHEST_M, LARGEST_LOG_SCALE, POSITION, ROTATION, SCALE, Cloud
from ..json_file import Fields, decoded, misfit

#: Version of the messages that are understood.
VERSION = 1
#: What every message holds.
NEEDED = (*POSITION, *SCALE, *ROTATION, "opacity", "rf_power_db")
#: More Gaussians, columns or characters of a head than these are damage.
MOST_GAUSSIANS, MOST_COLUMNS, LONGEST_HEAD = 1_000_000, 64, 4096
#: So many bytes are taken at a time, so that a flood does not hold Blender up.
_AT_ONCE = 1 << 24
_PIECE = 1 << 18
_PATIENCE_S = 2.0
_LOOPBACK = "127.0.0.1"
#: The head of a message.
_FORM = Fields({"time_s": float, "columns": [str], "count": int, "bytes": int})
#: Opacities this close to none and all have a logarithm.
_INSIDE = 1e-6


@dataclass(frozen=True)
class Update:
    """What one message says."""

    time_s: float
    """Time of the stream [s]."""
    cloud: Cloud
    """Gaussians of finite numbers; others are left out."""
    left_out: int
    """How many were left out."""


@dataclass(frozen=True)
class _Head:
    time_s: float
    columns: tuple[str, ...]
    count: int

    @property
    def size(self) -> int:
        return 4 * self.count * len(self.columns)


class Feed:
    """One connection."""

    def __init__(self, port: int) -> None:
        """Connects to a port of this machine.

        Raises:
            AddonError: Nobody listens there.
        """
        self.name = f"{_LOOPBACK}, TCP port {port}"
        try:
            self._socket = socket.create_connection((_LOOPBACK, port), timeout=_PATIENCE_S)
        except OSError as error:
            raise AddonError(
                f"nobody sends at {self.name} ({error.strerror or error}); start rfgs live … "
                f"--feed-port {port} first, and set the port that it prints"
            ) from error
        self._socket.setblocking(False)
        self._held, self._ended = bytearray(), False

    def close(self) -> None:
        """Ends the connection."""
        self._socket.close()

    def newest(self) -> Update | None:
        """The newest update that has arrived whole since the last call; older ones are skipped.

        Raises:
            AddonError: The connection is over, or what came is no update.
        """
        self._receive()
        found: tuple[_Head, bytes] | None = None
        while (length := self._held.find(b"\n", 0, LONGEST_HEAD)) >= 0:
            head = self._head(bytes(self._held[:length]))
            end = length + 1 + head.size
            if len(self._held) < end:
                break
            found = head, bytes(self._held[length + 1 : end])
            del self._held[:end]
        if length < 0 and len(self._held) >= LONGEST_HEAD:
            raise self._senseless(f"a line of over {LONGEST_HEAD} characters")
        if found is not None:
            return _update(*found)
        if self._ended:
            raise AddonError(f"the feed at {self.name} has ended; start rfgs live again")
        return None

    def _receive(self) -> None:
        limit = len(self._held) + _AT_ONCE
        while not self._ended and len(self._held) < limit:
            try:
                piece = self._socket.recv(_PIECE)
            except BlockingIOError:
                return
            except OSError:
                piece = b""
            self._ended = not piece
            self._held += piece

    def _head(self, line: bytes) -> _Head:
        try:
            told = decoded(line)
        except ValueError as error:
            raise self._senseless(f"no JSON: {line[:40]!r}") from error
        if problem := misfit(told, Fields({"rfgs": int})):
            raise self._senseless(problem)
        # A newer version may have another form.
        if told["rfgs"] != VERSION:
            raise self._senseless(f"version {told['rfgs']}, expected {VERSION}")
        if problem := misfit(told, _FORM):
            raise self._senseless(problem)
        columns, count = told["columns"], told["count"]
        if len(columns) > MOST_COLUMNS or len(set(columns)) < len(columns):
            raise self._senseless(f"{len(columns)} columns, expected {MOST_COLUMNS} at most, once")
        lacking = [name for name in NEEDED if name not in columns]
        if lacking:
            raise self._senseless(f"no column {lacking[0]}")
        if not 0 <= count <= MOST_GAUSSIANS:
            raise self._senseless(f"count {count}, expected 0 to {MOST_GAUSSIANS}")
        head = _Head(float(told["time_s"]), tuple(columns), count)
        if told["bytes"] != head.size:
            raise self._senseless(f"{told['bytes']} bytes, expected {head.size}")
        return head

    def _senseless(self, what: str) -> AddonError:
        return AddonError(f"{self.name} sends no updates of rfgs live ({what}); check the port")


def _update(head: _Head, data: bytes) -> Update:
    rows = np.frombuffer(data, "<f4").reshape(head.count, len(head.columns))
    place = {name: index for index, name in enumerate(head.columns)}

    def of(*names: str) -> np.ndarray:
        return rows[:, [place[name] for name in names]].astype(np.float32)

    good = np.isfinite(of(*NEEDED)).all(axis=1)
    good &= (np.abs(of(*POSITION)) <= FARTHEST_M).all(axis=1)
    scales = of(*SCALE)
    good &= ((scales > 0) & (scales <= math.exp(LARGEST_LOG_SCALE))).all(axis=1)
    length = np.linalg.norm(of(*ROTATION).astype(np.float64), axis=1)
    good &= (length > 1e-6) & (length < 1e6)
    rows, length = rows[good], length[good]
    opacities = np.clip(of("opacity")[:, 0], _INSIDE, 1 - _INSIDE)
    quats = (of(*ROTATION) / length[:, None]).astype(np.float32)
    stored = {name: of(name)[:, 0] for name in (*POSITION, "rf_power_db")}
    # As a PLY holds them, so that the cloud can be exported like any other.
    stored["opacity"] = np.log(opacities / (1 - opacities)).astype(np.float32)
    stored |= {name: np.log(of(name)[:, 0]) for name in SCALE}
    stored |= {name: quats[:, index].copy() for index, name in enumerate(ROTATION)}
    grey = np.full((len(rows), 3), 0.5, np.float32)
    cloud = Cloud(of(*POSITION), of(*SCALE), quats, opacities, grey, stored)
    return Update(head.time_s, cloud, int((~good).sum()))
