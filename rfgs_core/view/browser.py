# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium that looks at one page, driven by Playwright."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rfgs_core.errors import MissingToolError, RfgsError

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: Names under which Chromium is installed.
PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

#: Drawing without a GPU, and without the sandbox that containers do not allow.
_OPTIONS = (
    *("--no-sandbox", "--disable-dev-shm-usage"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
#: Any one thing takes no longer, on a busy machine without a GPU [s].
_PATIENCE_S = 120.0


def find_chromium() -> Path:
    """The program.

    Raises:
        MissingToolError: It, or what drives it, is not installed.
    """
    try:
        import playwright  # noqa: F401
    except ImportError as error:
        raise MissingToolError(
            "Playwright takes the picture; install it (`pip install 'rfgs[picture]'`), or leave "
            "out --picture and open the page yourself"
        ) from error
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
        MissingToolError: Chromium or Playwright is not installed.
        RfgsError: It does not start, or the page cannot be used.
    """
    program = find_chromium()
    from playwright.sync_api import Error, sync_playwright

    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=program, args=_OPTIONS)
            page = browser.new_page(viewport={"width": width_px, "height": height_px})
            page.set_default_timeout(_PATIENCE_S * 1e3)
            page.goto(url)
            yield page
            browser.close()
    except Error as error:
        raise RfgsError(f"Chromium: {error.message.splitlines()[0]}") from error


#: A page that has looked the same for so long has come to rest [s].
_STILL_S = 3.0


def settled_picture(page: Page, limit_s: float) -> bytes:
    """A page once it has looked the same for a while, PNG.

    Raises:
        RfgsError: It keeps changing until the limit.
    """
    begin = since = time.monotonic()
    before = page.screenshot()
    while time.monotonic() - begin < limit_s:
        page.wait_for_timeout(500.0)
        now = page.screenshot()
        if now != before:
            before, since = now, time.monotonic()
        elif time.monotonic() - since >= _STILL_S:
            return now
    raise RfgsError(f"the page did not come to rest within {limit_s:.0f} s")
