# SPDX-License-Identifier: Apache-2.0
"""A picture of the whole page, taken by a headless Chromium on this machine."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from rfgs_core.errors import RfgsError
from rfgs_core.files import write_bytes
from rfgs_core.view.browser import open_page, settled_picture
from rfgs_core.view.server import address

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from rfgs_core.view.page_server import PageServer

#: Size of the page [px].
WIDTH_PX, HEIGHT_PX = 1280, 840
NARROWEST_PX, WIDEST_PX = 320, 4096
#: Without a GPU a page takes a minute; on a busy machine, longer.
LIMIT_S = 300.0

#: Without a GPU the page warns about that; in a picture it would hide the scene.
DISMISS = "document.querySelectorAll('.mantine-Notification-closeButton').forEach(e => e.click())"


def take_picture(server: PageServer, file: Path, width_px: int = WIDTH_PX) -> None:
    """Writes what the page of a server looks like, PNG.

    Args:
        server: The server.
        file: The picture.
        width_px: Width of the page [px].

    Raises:
        MissingToolError: Chromium is not installed.
        RfgsError: The page does not connect or does not come to rest.
    """
    with open_page(address(server), width_px, HEIGHT_PX) as page:
        wait_for_page(server, page)
        settled_picture(page, LIMIT_S)
        page.evaluate(DISMISS)
        write_bytes(file, settled_picture(page, LIMIT_S))


def wait_for_page(server: PageServer, page: Page) -> None:
    """Waits until a page has connected to its server.

    Raises:
        RfgsError: It does not.
    """
    until = time.monotonic() + LIMIT_S
    while not server.get_clients():
        if time.monotonic() > until:
            raise RfgsError(f"the page did not connect within {LIMIT_S:.0f} s")
        page.wait_for_timeout(200.0)
