# SPDX-License-Identifier: Apache-2.0
"""The web server of the viewer: starts where it was asked to, or says why not."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rfgs_core.errors import RfgsError

if TYPE_CHECKING:
    from rfgs_core.view.page_server import PageServer


@contextlib.contextmanager
def running_server(host: str, port: int) -> Iterator[PageServer]:
    """A web server for as long as the block runs.

    Args:
        host: Address to listen at; 127.0.0.1 is reached from this machine only.
        port: Port to listen at; 0 takes any free one.

    Raises:
        RfgsError: The address is none of this machine's, or the port is taken or not allowed.
    """
    from rfgs_core.view.page_server import PageServer

    _check_free(host, port)
    # It prints a greeting and a farewell of its own.
    with contextlib.redirect_stdout(io.StringIO()):
        server = PageServer(host, port)
    try:
        # The server looks for another port by itself where somebody was faster.
        if port not in (0, server.get_port()):
            raise _busy(host, port)
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def address(server: PageServer) -> str:
    """Where a browser of this machine finds the page; whoever knows it may look."""
    host = server.get_host()
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    host = f"[{host}]" if ":" in host else host
    return f"http://{host}:{server.get_port()}/{server.token}"


def _check_free(host: str, port: int) -> None:
    if not 0 <= port <= 65535:
        raise RfgsError(f"--port {port}: expected 0 to 65535")
    try:
        family, kind, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(place)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise _busy(host, port) from error
        if error.errno == errno.EACCES:
            raise RfgsError(
                f"--port {port}: not allowed for this user; expected a port from 1024 up"
            ) from error
        raise RfgsError(
            f"--host {host}: not an address of this machine ({error.strerror}); "
            "expected 127.0.0.1 for this machine only, or 0.0.0.0 for its network"
        ) from error


def _busy(host: str, port: int) -> RfgsError:
    return RfgsError(
        f"port {port} of {host} is in use; stop the program that uses it, or choose another "
        "with --port (0 takes any free one)"
    )
