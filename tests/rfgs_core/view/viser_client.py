# SPDX-License-Identifier: Apache-2.0
"""A client of the viewer's websocket that is no browser: it keeps what a page would show."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import connect

from rfgs_core.view.page_server import PageServer
from rfgs_core.view.server import address


class Client:
    """Nodes of the scene by name and controls by label, as the server has sent them."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self.nodes: dict[str, dict[str, Any]] = {}
        self.controls: dict[str, dict[str, Any]] = {}

    def read(self, until: Callable[[], Any], limit_s: float = 30.0) -> None:
        """Takes messages until something is so."""
        end = time.monotonic() + limit_s
        while not until():
            for message in _decoded(self._socket.recv(timeout=max(0.0, end - time.monotonic()))):
                self._take(message)

    def choose(self, label: str, value: Any) -> None:
        """Moves a control, as a user of the page would."""
        uuid = self.controls[label]["uuid"]
        self._send("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def send(self, raw: bytes | str) -> None:
        """Sends anything."""
        self._socket.send(raw)

    def look(self) -> None:
        """Tells where this client looks from; nobody is heard before that."""
        self._send(
            "ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0), position=(0.0, 0.0, 3.0), fov=1.0, near=0.1, far=100.0,
            image_height=480, image_width=640, look_at=(0.0, 0.0, 0.0),
            up_direction=(0.0, 0.0, 1.0),
        )  # fmt: skip

    def labelled(self, kind: str) -> list[dict[str, Any]]:
        """Controls of a kind."""
        return [row for row in self.controls.values() if row["type"] == kind]

    def _send(self, kind: str, **values: Any) -> None:
        self._socket.send(msgspec.msgpack.encode({"type": kind, **values}))

    def _take(self, message: dict[str, Any]) -> None:
        kind, props = message["type"], message.get("props")
        if kind == "RemoveSceneNodeMessage":
            self.nodes.pop(message["name"], None)
        elif kind == "SetSceneNodeVisibilityMessage":
            self.nodes.setdefault(message["name"], {})["visible"] = message["visible"]
        elif kind == "GuiUpdateMessage":
            for row in self.controls.values():
                if row["uuid"] == message["uuid"]:
                    row.update(message["updates"])
        elif kind.startswith("Gui") and props is not None:
            label = props.get("label") or message["uuid"]
            row = {"type": kind, "uuid": message["uuid"], "value": message.get("value")}
            self.controls[label] = {**props, **row}
        elif "name" in message and props is not None:
            self.nodes[message["name"]] = {"type": kind, "visible": True, **props}


def opened(where: str, **headers: str) -> Any:
    """A socket at the address of a page, with headers that a browser would send."""
    protocol: Any = f"viser-v{viser.__version__}"
    return connect(
        where.replace("http://", "ws://"), subprotocols=[protocol], max_size=None,
        compression=None, additional_headers=headers,
    )  # fmt: skip


@contextlib.contextmanager
def connected(server: PageServer) -> Iterator[Client]:
    """A client that is connected to a server of this machine."""
    with opened(address(server)) as socket:
        client = Client(socket)
        client.look()
        yield client


def _decoded(raw: bytes | str) -> list[dict[str, Any]]:
    """Messages of a packet: sizes, compressed msgpack, then arrays on multiples of 8 bytes."""
    assert isinstance(raw, bytes)
    size = int.from_bytes(raw[8:16], "little")
    window = msgspec.msgpack.decode(zstandard.decompress(raw[16 : 16 + size]))
    buffers, place = [], 16 + size
    for length in window["binaryBufferLengths"]:
        place += -place % 8
        buffers.append(raw[place : place + length])
        place += length
    return [_filled(message, buffers) for message in window["messages"]]


def _filled(value: Any, buffers: list[bytes]) -> Any:
    if isinstance(value, dict):
        if "__binary_index" in value:
            return np.frombuffer(buffers[value["__binary_index"]], value["dtype"])
        return {key: _filled(item, buffers) for key, item in value.items()}
    return [_filled(item, buffers) for item in value] if isinstance(value, list) else value
