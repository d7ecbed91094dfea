# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium that looks at one page, through its DevTools protocol."""

from __future__ import annotations

import base64
import contextlib
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rfgs_core.errors import MissingToolError, RfgsError

#: Names under which Chromium is installed.
PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

#: Drawing without a GPU, and without the sandbox that containers do not allow.
_OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--hide-scrollbars", "--disable-background-networking", "--disable-component-update"),
    "--remote-debugging-port=0",
)
_START_S = 60.0
_ANSWER_S = 120.0


def find_chromium() -> Path:
    """The program.

    Raises:
        MissingToolError: It is not installed.
    """
    for name in PROGRAMS:
        found = shutil.which(name)
        if found:
            return Path(found)
    raise MissingToolError(
        "no Chromium was found, which takes the picture; install it (Debian: "
        "`apt-get install -y chromium`), or leave out --picture and open the page yourself"
    )


@contextlib.contextmanager
def open_page(url: str, width_px: int, height_px: int) -> Iterator[Page]:
    """A page in a Chromium of its own, for as long as the block runs.

    Raises:
        MissingToolError: Chromium is not installed.
        RfgsError: It does not start.
    """
    from websockets.sync.client import connect

    program = find_chromium()
    with tempfile.TemporaryDirectory(prefix="rfgs-chromium-", ignore_cleanup_errors=True) as home:
        options = [*_OPTIONS, f"--user-data-dir={home}", f"--window-size={width_px},{height_px}"]
        process = subprocess.Popen(
            [str(program), *options, "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            with connect(_devtools(process, Path(home)), max_size=None) as socket:
                page = Page(socket)
                page.start(url, width_px, height_px)
                yield page
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(20)
            process.kill()


class Page:
    """One page; every call waits for its answer."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._session, self._last = socket, "", 0
        self.requests: list[str] = []
        """Addresses the page has asked for, without what it carries in itself."""
        self.console: list[str] = []
        """Errors the page has reported."""

    def start(self, url: str, width_px: int, height_px: int) -> None:
        """Opens the address."""
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Network", "Runtime"):
            self._ask(f"{domain}.enable")
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            width=width_px, height=height_px, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip
        self._ask("Page.navigate", url=url)
        until = time.monotonic() + _START_S
        while self.evaluate("document.readyState") != "complete":
            if time.monotonic() > until:
                raise RfgsError(f"Chromium did not load {url} within {_START_S:.0f} s")
            time.sleep(0.2)

    def evaluate(self, script: str) -> Any:
        """Value of a JavaScript expression."""
        answer = self._ask("Runtime.evaluate", expression=script, returnByValue=True)
        return answer["result"].get("value")

    def picture(self) -> bytes:
        """The page as it looks now, PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])

    def settled_picture(self, limit_s: float, still_s: float = 3.0) -> bytes:
        """The page once it has looked the same for a while.

        Raises:
            RfgsError: It keeps changing until the limit.
        """
        begin = since = time.monotonic()
        before = self.picture()
        while time.monotonic() - begin < limit_s:
            time.sleep(0.5)
            now = self.picture()
            if now != before:
                before, since = now, time.monotonic()
            elif time.monotonic() - since >= still_s:
                return now
        raise RfgsError(f"the page did not come to rest within {limit_s:.0f} s")

    def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._last += 1
        question = {"id": self._last, "method": method, "params": parameters}
        if self._session:
            question["sessionId"] = self._session
        self._socket.send(json.dumps(question))
        until = time.monotonic() + _ANSWER_S
        while True:
            message = json.loads(self._socket.recv(timeout=max(0.0, until - time.monotonic())))
            if message.get("id") == self._last:
                if "error" in message:
                    raise RfgsError(f"Chromium: {method}: {message['error']['message']}")
                return message["result"]
            self._note(message)

    def _note(self, event: dict[str, Any]) -> None:
        """Keeps what the page asks for and complains about."""
        values = event.get("params", {})
        if event.get("method") == "Network.requestWillBeSent":
            url = values["request"]["url"]
            if not url.startswith(("data:", "blob:")):
                self.requests.append(url)
        elif event.get("method") == "Network.webSocketCreated":
            self.requests.append(values["url"])
        elif event.get("method") == "Runtime.exceptionThrown":
            self.console.append(str(values["exceptionDetails"].get("text")))


def _devtools(process: subprocess.Popen[bytes], home: Path) -> str:
    """Where Chromium listens, once it has written that down."""
    file, until = home / "DevToolsActivePort", time.monotonic() + _START_S
    while time.monotonic() < until and process.poll() is None:
        if file.is_file() and len(lines := file.read_text().split()) == 2:
            return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
        time.sleep(0.1)
    raise RfgsError(f"Chromium did not start within {_START_S:.0f} s (exit {process.poll()})")
