# SPDX-License-Identifier: Apache-2.0
"""A video of the viewer's scene: frames in their own time, seen by a camera that swings around."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float64, UInt8
from PIL import Image, ImageDraw, ImageFont
from tqdm import tqdm

from rfgs_core.video import write_video
from rfgs_core.view.browser import open_page
from rfgs_core.view.colors import TITLES, ends_of, strip_of
from rfgs_core.view.server import address
from rfgs_core.view.snapshot import DISMISS, wait_for_page

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from rfgs_core.view.page_server import PageServer
    from rfgs_core.view.viewer import Viewer

#: Size of the page, controls included [px].
WIDTH_PX, HEIGHT_PX = 1200, 560
PICTURES_PER_S = 8.0
#: Shorter runs are played again and again, longer ones are cut off [s].
LEAST_S, MOST_S = 6.0, 30.0
#: The camera swings so far to each side, and back, once in a video.
SWING_RAD = math.radians(35.0)

_WHERE = """() => {
  const box = document.querySelector('canvas').getBoundingClientRect();
  return {x: box.x, y: box.y, width: box.width, height: box.height};
}"""
_DRAWN = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
_SAYS = "text => document.body.innerText.includes(text)"
_INK, _BAR_PX, _FONT_PX = (232, 234, 240), 34, 15


def swung(
    position_m: Float64[np.ndarray, "3"], centre_m: Float64[np.ndarray, "3"], share: float
) -> Float64[np.ndarray, "3"]:
    """Where the camera is after a share of the video: on a level arc around what it looks at.

    Args:
        position_m: Where it begins and ends [m].
        centre_m: What it looks at [m].
        share: Part of the video that has passed, from 0 to 1.
    """
    angle = SWING_RAD * math.sin(2.0 * math.pi * share)
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return centre_m + turn @ (position_m - centre_m)


def frames_shown(time_s: Float64[np.ndarray, "frame"]) -> list[int]:
    """Which frame each picture of the video shows, by its place in the run.

    Args:
        time_s: Times of the run's frames, ascending [s].
    """
    ends = 0.5 * (time_s[1:] + time_s[:-1])
    step_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    lasts_s = float(time_s[-1] - time_s[0]) + step_s
    rounds = max(1, math.ceil(LEAST_S / lasts_s))
    count = round(min(rounds * lasts_s, MOST_S) * PICTURES_PER_S)
    since_s = (np.arange(count) / PICTURES_PER_S) % lasts_s
    return np.searchsorted(ends, time_s[0] - 0.5 * step_s + since_s, side="right").tolist()


def record(viewer: Viewer, server: PageServer, file: Path) -> None:
    """Writes a video of what the viewer shows on its server, .mp4 or .webp.

    Raises:
        MissingToolError: Chromium or ffmpeg is not installed.
        RfgsError: The page does not connect, or the file cannot be written.
    """
    with open_page(address(server), WIDTH_PX, HEIGHT_PX) as page:
        wait_for_page(server, page)
        page.wait_for_timeout(1000.0)
        page.evaluate(DISMISS)
        write_video(file, _pictures(viewer, page), PICTURES_PER_S)


def _pictures(viewer: Viewer, page: Page) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    (client,) = viewer.server.get_clients().values()
    start, centre = np.array(client.camera.position), np.array(client.camera.look_at)
    numbers = viewer.frames.numbers
    times = np.array([viewer.time_s(frame) for frame in numbers])
    shown, where = frames_shown(times), page.evaluate(_WHERE)
    for index, place in enumerate(tqdm(shown, desc="record", unit="picture")):
        viewer.panel.set("frame", numbers[place])
        viewer.update()
        with client.atomic():
            client.camera.position = tuple(swung(start, centre, index / len(shown)))
            client.camera.look_at = tuple(centre)
        # Said last, beside what is recorded: whoever reads it has drawn everything before it.
        viewer.server.gui.set_panel_label(f"picture {index + 1}.")
        page.wait_for_function(_SAYS, arg=f"picture {index + 1}.")
        page.evaluate(_DRAWN)
        with Image.open(io.BytesIO(page.screenshot(clip=where))) as picture:
            yield _labelled(picture.convert("RGB"), viewer, float(times[place]))


def _labelled(picture: Image.Image, viewer: Viewer, time_s: float) -> UInt8[np.ndarray, "h w 3"]:
    """A picture with its time, and what its colours mean, below."""
    from matplotlib.font_manager import findfont

    mode = viewer.panel.selection().mode
    width, height = picture.size
    page = Image.new("RGB", (width, height + _BAR_PX), (24, 26, 31))
    page.paste(picture, (0, 0))
    draw: Any = ImageDraw.Draw(page)
    font = ImageFont.truetype(findfont("DejaVu Sans"), _FONT_PX)  # Pillow's own has no ≥.
    middle = height + _BAR_PX // 2
    draw.text((12, middle), f"{time_s:.2f} s", fill=_INK, font=font, anchor="lm")
    scale = viewer.scales[mode]
    if mode == "display":
        text = "colours fitted to pictures afterwards, for display"
        draw.text((width - 12, middle), text, fill=_INK, font=font, anchor="rm")
        return np.asarray(page)
    low, high = ends_of(mode, scale)
    right = width - 12 - draw.textlength(high, font=font)
    draw.text((width - 12, middle), high, fill=_INK, font=font, anchor="rm")
    strip = Image.fromarray(strip_of(mode, 180)).resize((180, 12))
    page.paste(strip, (int(right) - 190, middle - 6))
    text = f"{TITLES[mode]}:  {low}"
    draw.text((right - 200, middle), text, fill=_INK, font=font, anchor="rm")
    return np.asarray(page)
