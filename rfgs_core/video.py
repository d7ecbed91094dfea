# SPDX-License-Identifier: Apache-2.0
"""Videos of pictures: MP4 by the program ffmpeg, or WebP, which every browser plays, without it."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.files import replacing

#: Quality of a WebP, 100 at most.
_QUALITY = 80


def check_video(path: Path) -> None:
    """Refuses a video that cannot be written, before long work.

    Raises:
        RfgsError: The name ends in something else than .mp4 or .webp.
        MissingToolError: An .mp4 is asked for, and there is no ffmpeg.
    """
    if path.suffix.lower() not in (".mp4", ".webp"):
        raise RfgsError(f"{path}: expected a file name ending in .mp4 or .webp")
    if path.suffix.lower() == ".mp4" and _ffmpeg() is None:
        raise MissingToolError(
            f"{path}: ffmpeg writes .mp4 and was not found; install it (`pip install "
            f"'rfgs[video]'`, or Debian: `apt-get install -y ffmpeg`), or name the file "
            f"{path.stem}.webp, which needs nothing"
        )


def _ffmpeg() -> str | None:
    """The system's program, else the one that the extra `video` brings."""
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ModuleNotFoundError, RuntimeError):
        return None


def write_video(
    path: Path, pictures: Iterable[UInt8[np.ndarray, "h w 3"]], pictures_per_s: float
) -> None:
    """Writes a video, whole or not at all.

    Args:
        path: File to write, .mp4 or .webp.
        pictures: All of one size; taken one after the other.
        pictures_per_s: How fast they follow each other [1/s].

    Raises:
        RfgsError: The file cannot be written, or there is no picture.
    """
    check_video(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        write = _write_mp4 if path.suffix.lower() == ".mp4" else _write_webp
        write(temporary, pictures, pictures_per_s)


def _write_webp(path: Path, pictures: Iterable[np.ndarray], pictures_per_s: float) -> None:
    from PIL import Image

    images = [Image.fromarray(picture) for picture in pictures]
    if not images:
        raise RfgsError("a video needs at least one picture")
    images[0].save(
        path, format="WEBP", save_all=True, append_images=images[1:], loop=0, quality=_QUALITY,
        duration=round(1e3 / pictures_per_s),
    )  # fmt: skip


def _write_mp4(path: Path, pictures: Iterable[np.ndarray], pictures_per_s: float) -> None:
    rows = iter(pictures)
    first = next(rows, None)
    if first is None:
        raise RfgsError("a video needs at least one picture")
    height, width = first.shape[:2]
    program = _ffmpeg()
    assert program is not None
    command = [
        *(program, "-y", "-loglevel", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"),
        *("-r", f"{pictures_per_s:g}", "-i", "-"),
        # Its colours are stored for blocks of two by two pixels.
        *("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-c:v", "libx264"),
        *("-movflags", "+faststart", "-f", "mp4", str(path)),
    ]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stderr=pipe, text=False) as ffmpeg:
        assert ffmpeg.stdin is not None and ffmpeg.stderr is not None
        ended_early = False
        try:
            ffmpeg.stdin.write(np.ascontiguousarray(first).tobytes())
            for picture in rows:
                ffmpeg.stdin.write(np.ascontiguousarray(picture).tobytes())
            ffmpeg.stdin.close()
        except BrokenPipeError:
            # What it wrote is cut short, whatever its exit code says.
            ended_early = True
            # What waits in the pipe's buffer cannot be written either.
            with suppress(BrokenPipeError):
                ffmpeg.stdin.close()
        except BaseException:
            ffmpeg.kill()
            raise
        said = ffmpeg.stderr.read().decode("utf-8", "replace").strip().splitlines()
    if ffmpeg.returncode or ended_early:
        raise RfgsError(f"ffmpeg could not write the video: {said[-1] if said else 'no reason'}")
