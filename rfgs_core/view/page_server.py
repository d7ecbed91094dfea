# SPDX-License-Identifier: Apache-2.0
"""Viser's server behind a guard: every request and every message is looked at first."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any

import websockets.asyncio.server
from viser import ViserServer
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from rfgs_core.view.guard import Faults, Guard, hardened
from rfgs_core.view.messages import LARGEST_BYTES, complaint

Handler = Callable[[ServerConnection], Awaitable[None]]


class PageServer(ViserServer):
    """The server of one page, at an address that only its user is told."""

    def __init__(self, host: str, port: int) -> None:
        """Starts listening.

        Args:
            host: Address to listen at.
            port: Port to listen at; 0 takes any free one.
        """
        faults = Faults()
        self._guard = Guard(host, faults)
        gate = _Gate(self._guard, faults)
        with _serving_through(gate):
            super().__init__(host=host, port=port, verbose=False)
        pool = self._thread_executor
        pool.submit = gate.telling(pool.submit)
        # Controls have no public register; until it is known no message is heard.
        gate.controls = self.gui._gui_input_handle_from_uuid

    @property
    def token(self) -> str:
        """The path of the page."""
        return self._guard.token


class _Gate:
    """Stands between the network and viser's handlers."""

    def __init__(self, guard: Guard, faults: Faults) -> None:
        self.controls: Mapping[str, Any] = {}
        self._guard, self._faults = guard, faults
        # A logger of its own, for two servers of one process tell their faults apart.
        self._logger = logging.Logger(f"{__name__}.connections", logging.WARNING)
        self._logger.addFilter(self._told_once)

    def options(self, given: dict[str, Any]) -> dict[str, Any]:
        """Options of `websockets.serve` with this gate in front of what viser asks for."""
        behind = given["process_request"]

        def process_request(connection: ServerConnection, request: Request) -> Response | None:
            asyncio.get_running_loop().set_exception_handler(self._on_fault)
            answer = self._guard.admit(request) or behind(connection, request)
            return answer and hardened(answer)

        more = {"max_size": LARGEST_BYTES, "logger": self._logger}
        return {**given, **more, "process_request": process_request}

    def heard(self, handler: Handler) -> Handler:
        """A handler of connections that only receives messages of our page."""

        async def handle(connection: ServerConnection) -> None:
            receive = connection.recv

            async def recv(*arguments: Any, **options: Any) -> bytes | str:
                while True:
                    raw = await receive(*arguments, **options)
                    problem = complaint(raw, self.controls)
                    if not problem:
                        return raw
                    self._faults.tell(f"a message to the viewer was dropped: {problem}")

            connection.recv = recv  # type: ignore[method-assign]
            await handler(connection)

        return handle

    def telling(self, submit: Callable[..., Future[Any]]) -> Callable[..., Future[Any]]:
        """A pool's `submit` for callbacks whose faults are told in a line, not as a traceback."""

        def run(call: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
            try:
                return call(*arguments, **options)
            except Exception as error:
                self._faults.tell(f"the viewer goes on after a fault: {_said(error)}")
                return None

        return lambda call, *arguments, **options: submit(run, call, *arguments, **options)

    def _on_fault(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self._faults.tell(f"the viewer goes on after a fault: {_said(context.get('exception'))}")

    def _told_once(self, record: logging.LogRecord) -> bool:
        if record.levelno >= logging.WARNING:
            error = record.exc_info[1] if record.exc_info else None
            self._faults.tell(f"a connection to the viewer failed: {_said(error)}")
        return False


def _said(error: BaseException | None) -> str:
    """An error and its cause in words."""
    parts = [error, error.__cause__ if error else None]
    return ": ".join(str(part) or type(part).__name__ for part in parts if part) or "unknown"


@contextlib.contextmanager
def _serving_through(gate: _Gate) -> Iterator[None]:
    """Lets viser, which takes no guard of its own, serve through a gate within the block."""
    serve = websockets.asyncio.server.serve

    def guarded(handler: Handler, *arguments: Any, **options: Any) -> Any:
        return serve(gate.heard(handler), *arguments, **gate.options(options))

    websockets.asyncio.server.serve = guarded  # type: ignore[misc,assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
