# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser: a headless Chromium that draws without a GPU."""

from __future__ import annotations

import io
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import numpy as np
import pytest
from matplotlib import colormaps
from PIL import Image

from rfgs_core.errors import MissingToolError
from rfgs_core.run import Run
from rfgs_core.view.browser import find_chromium, open_page, settled_picture
from rfgs_core.view.server import address, running_server
from rfgs_core.view.snapshot import HEIGHT_PX, WIDTH_PX
from rfgs_core.view.viewer import Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow
LIMIT_S = 180.0
Python = Callable[..., subprocess.CompletedProcess[str]]
CLICK = "[...document.querySelectorAll('label')].find(e => e.innerText.trim() == '{}').click()"


@pytest.fixture(scope="module", autouse=True)
def chromium() -> None:
    try:
        find_chromium()
    except MissingToolError as error:
        pytest.skip(str(error))


@dataclass(frozen=True)
class Browser:
    """A viewer that colours by distance, and the browser that shows it."""

    viewer: Viewer
    page: Page
    asked: list[str]
    """Addresses the page has asked for, without what it carries in itself."""
    complaints: list[str]
    """Errors the page has reported."""


@pytest.fixture(scope="module")
def browser(known_run: Run) -> Iterator[Browser]:
    with running_server("127.0.0.1", 0) as server:
        viewer = Viewer(known_run, server, mode="error")
        with open_page("about:blank", 1000, 640) as page:
            shown = Browser(viewer, page, [], [])
            page.on("request", lambda request: shown.asked.append(request.url))
            page.on("websocket", lambda socket: shown.asked.append(socket.url))
            page.on("pageerror", lambda error: shown.complaints.append(str(error)))
            page.goto(address(server))
            wait_for(server.get_clients)
            yield shown


def wait_for(what: Callable[[], object]) -> None:
    begin = time.monotonic()
    while not what():
        assert time.monotonic() - begin < LIMIT_S
        time.sleep(0.2)


def tick(browser: Browser, label: str, done: Callable[[], bool]) -> None:
    """Clicks a checkbox of the page and lets the viewer follow until something is so."""
    viewer, page = browser.viewer, browser.page
    page.evaluate(CLICK.format(label))
    wait_for(lambda: viewer.step(limit_s=0.1) or done())


def pixels(page: Page) -> np.ndarray:
    """The scene without its controls, at rest."""
    with Image.open(io.BytesIO(settled_picture(page, LIMIT_S))) as image:
        return np.asarray(image.convert("RGB"))[:, :600].astype(int)


def far_ones(picture: np.ndarray) -> np.ndarray:
    """Columns of pixels in the colour of Gaussians 30 cm and more from the truth: dark red."""
    colour = np.array(colormaps["turbo"](1.0)[:3]) * 255
    return np.nonzero((np.abs(picture - colour) < 40).all(axis=2))[1]


def test_gaussians_are_drawn_move_and_hide(browser: Browser) -> None:
    viewer, page = browser.viewer, browser.page
    first = far_ones(pixels(page))
    # A quarter of the sphere's vertices stand half a metre outside it.
    assert len(first) > 100
    viewer.panel.set("frame", 2)
    viewer.update()
    second = far_ones(pixels(page))
    # The sphere goes 20 cm along x, which is to the right from where the page looks.
    assert second.mean() > first.mean() + 5
    everything = viewer.panel.selection()
    viewer.panel.set("min_opacity", 0.9)
    viewer.update()
    assert len(far_ones(pixels(page))) < 5
    viewer.panel.set("min_opacity", everything.min_opacity)


def test_clicks_on_the_page_reach_the_viewer(browser: Browser) -> None:
    panel = browser.viewer.panel
    tick(browser, "Room", lambda: not panel.selection().room)
    tick(browser, "Play", lambda: panel.playing)
    tick(browser, "Play", lambda: not panel.playing)
    tick(browser, "Room", lambda: panel.selection().room)
    assert browser.complaints == []


def test_the_page_asks_nobody_else(browser: Browser) -> None:
    asked = [url for url in browser.asked if not url.startswith(("data:", "blob:"))]
    assert any(url.startswith("ws:") for url in asked)
    assert {urlsplit(url).netloc for url in asked} == {
        urlsplit(address(browser.viewer.server)).netloc
    }


def test_a_picture_of_the_page(python: Python, known_run: Run, tmp_path: Path) -> None:
    file = tmp_path / "page.png"
    # In a process of its own: one browser at a time is driven from a thread.
    with socket.socket() as another_viewer:
        another_viewer.bind(("127.0.0.1", 0))
        another_viewer.listen()
        port = another_viewer.getsockname()[1]
        arguments = ["view", known_run.path, "--port", port, "--picture", file]
        python("-m", "rfgs_core.cli", *arguments, must_work=True)
    with Image.open(file) as image:
        assert image.size == (WIDTH_PX, HEIGHT_PX)
        picture = np.asarray(image.convert("RGB")).astype(int)
    # The warning about software drawing is gone: it stands in the upper left, with a bright bar.
    assert np.ptp(picture[10:150, 10:300], axis=(0, 1)).max() < 60
    # The red ball of the true pictures is there, in the panel.
    red = (picture[..., 0] > 170) & (picture[..., 1] < 90) & (picture[..., 2] < 80)
    assert red[:, 880:].sum() > 300
