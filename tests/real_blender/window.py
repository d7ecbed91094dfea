# SPDX-License-Identifier: Apache-2.0
"""A real Blender with a window on a screen that nobody sees, and photographs of it."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

STAGE = Path(__file__).with_name("onstage.py")
SIZE = (1400, 1000)


@contextmanager
def screen(folder: Path, size: tuple[int, int] = SIZE) -> Iterator[str]:
    """An X server without a monitor; its picture lies in FOLDER/Xvfb_screen0.

    Yields:
        Its DISPLAY.
    """
    program = shutil.which("Xvfb")
    if program is None:
        pytest.skip("no window: Xvfb is missing; run: apt-get install xvfb")
    reading, writing = os.pipe()
    server = subprocess.Popen(
        [
            *(program, "-displayfd", str(writing), "-nolisten", "tcp", "-nocursor"),
            *("-fbdir", str(folder)),
            *("-screen", "0", f"{size[0]}x{size[1]}x24"),
        ],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    try:
        with os.fdopen(reading) as answer:
            number = answer.readline().strip()
        assert number, "Xvfb does not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


def play(
    blender,
    script: Path,
    blend: Path,
    out: Path,
    *arguments: str | Path,
    size: tuple[int, int] = SIZE,
    timeout: float = 280.0,
) -> subprocess.CompletedProcess[str]:
    """Opens a file in Blender's window and plays a script there, see `onstage.py`.

    Args:
        blender: The `blender` fixture.
        script: File with `play(stage)`.
        blend: File to open.
        out: Folder of the pictures, made if missing.
        *arguments: `stage.arguments`.
        size: Of the window [px].
        timeout: Blender is killed then [s].

    Returns:
        What Blender said; its exit code is 0 when the script came to its end.
    """
    out.mkdir(parents=True, exist_ok=True)
    own = blender.resources / "window"
    for name in ("screen", "run", "tmp"):
        (own / name).mkdir(parents=True, exist_ok=True)
    with screen(own / "screen", size) as display:
        framebuffer = own / "screen" / "Xvfb_screen0"
        done = subprocess.run(
            [
                *(str(blender.program), "--gpu-backend", "opengl", "--enable-event-simulate"),
                *("--window-geometry", "0", "0", str(size[0]), str(size[1])),
                *(str(blend), "--disable-autoexec", "--python", str(STAGE), "--"),
                *map(str, (script, framebuffer, out, *arguments)),
            ],
            env={
                **os.environ,
                "BLENDER_USER_RESOURCES": str(blender.resources),
                "DISPLAY": display,
                "WAYLAND_DISPLAY": "",
                "XDG_RUNTIME_DIR": str(own / "run"),
                "TMPDIR": str(own / "tmp"),
            },
            cwd=blender.resources,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
    for file in out.glob("*.xwd"):
        _develop(file)
    return done


def _develop(file: Path) -> None:
    """Makes a PNG of a copied frame buffer (X window dump) and removes the copy."""
    raw = file.read_bytes()
    header = struct.unpack(">25I", raw[:100])
    start, width, height, line, colours = (header[i] for i in (0, 4, 5, 12, 19))
    pixels = np.frombuffer(raw, np.uint8, line * height, start + 12 * colours)
    picture = Image.fromarray(pixels.reshape(height, line // 4, 4)[:, :width, 2::-1].copy())
    note = file.with_suffix(".json")
    crop = json.loads(note.read_text())["crop"]
    if crop:
        x, y, width, height = crop
        picture = picture.crop((x, y, x + width, y + height))
    picture.save(file.with_suffix(".png"), optimize=True)
    file.unlink()
    note.unlink()
