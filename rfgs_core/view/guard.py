# SPDX-License-Identifier: Apache-2.0
"""Who may open the viewer's page: whoever knows its address, and no page of somebody else."""

from __future__ import annotations

import http
import ipaddress
import logging
import secrets
import socket
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

_LOG = logging.getLogger(__name__)

#: Names of this machine that no foreign name server answers for.
_LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
_EVERYWHERE = frozenset({"0.0.0.0", "::", ""})
#: So many different faults are told; what follows is like them.
_MOST_FAULTS = 20
#: The page is in no frame of another one, and tells nobody its address.
_HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Faults:
    """Tells each kind of fault once, in one line."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def tell(self, fault: str) -> None:
        """Logs a fault that is new."""
        line = "".join(char if char.isprintable() else "?" for char in fault)[:200]
        if line in self._told or len(self._told) > _MOST_FAULTS:
            return
        self._told.add(line)
        last = len(self._told) > _MOST_FAULTS
        _LOG.warning("%s", "further faults of this kind are not shown" if last else line)


class Guard:
    """Refuses requests that do not name this server and its token."""

    def __init__(self, host: str, faults: Faults) -> None:
        """Draws a token.

        Args:
            host: Address that the server listens at.
            faults: Takes what was refused.
        """
        self.token = secrets.token_urlsafe(16)
        self._everywhere = host in _EVERYWHERE
        own = {socket.gethostname().lower()} if self._everywhere else {host.lower()}
        self._names = _LOOPBACK | own
        self._faults = faults

    def admit(self, request: Request) -> Response | None:
        """Refuses a request, or takes the token out of its path for the server behind.

        Returns:
            What to answer instead; None where the request may pass.
        """
        complaint = self._complaint(request)
        if complaint:
            self._faults.tell(f"a request to the viewer was refused: {complaint}")
            return _refusal()
        request.path = "/"
        return None

    def _complaint(self, request: Request) -> str:
        """Why a request is refused, in words; empty if it is not."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return f"expected the address of this server as Host, found {', '.join(hosts)!r}"
        own = (f"http://{hosts[0]}".lower(), f"https://{hosts[0]}".lower())
        if any(origin.lower() not in own for origin in origins):
            return f"expected a page of this server as Origin, found {', '.join(origins)!r}"
        given = request.path.partition("?")[0].strip("/")
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return "expected the address that was printed when the viewer began, with its token"
        upgrades = request.headers.get_all("Upgrade")
        if upgrades and upgrades != ["websocket"]:
            return f"expected the upgrade to a websocket, found {', '.join(upgrades)!r}"
        return "" if not upgrades else _wrong_protocol(request)

    def _is_own(self, host: str) -> bool:
        """Whether a Host header names this server; its port may be a forwarded one."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        return name in self._names or (self._everywhere and _is_number(name))


def hardened(response: Response) -> Response:
    """The answer with headers that keep the page and its address to itself."""
    for name, value in _HEADERS.items():
        response.headers[name] = value
    return response


def _wrong_protocol(request: Request) -> str:
    """Why the page of another version is refused; empty for our own."""
    import viser

    protocols = request.headers.get_all("Sec-WebSocket-Protocol")
    if protocols == [f"viser-v{viser.__version__}"]:
        return ""
    return f"expected the page of viser {viser.__version__}, found {', '.join(protocols)!r}"


def _is_number(name: str) -> bool:
    """Whether a host is an address in numbers, which no name server can redirect."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _refusal() -> Response:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    text = b"refused; open the address that rfgs view has printed\n"
    headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(text))})
    return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", headers, text)
