# SPDX-License-Identifier: Apache-2.0
"""Videos hold the pictures they were given, at the speed they were given, or are refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from imageio_ffmpeg import get_ffmpeg_exe
from PIL import Image

from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.video import check_video, write_video

SHADES = (30, 120, 220)


def pictures(width: int = 64, height: int = 48) -> list[np.ndarray]:
    return [np.full((height, width, 3), shade, np.uint8) for shade in SHADES]


def test_a_webp_plays_every_picture_for_its_time(tmp_path: Path) -> None:
    write_video(tmp_path / "new" / "a.webp", pictures(), 4.0)
    with Image.open(tmp_path / "new" / "a.webp") as video:
        assert video.n_frames == 3
        for index, shade in enumerate(SHADES):
            video.seek(index)
            video.load()
            assert video.info["duration"] == 250
            assert abs(np.asarray(video.convert("RGB")).astype(int) - shade).max() < 6


def test_an_mp4_of_odd_size_is_padded_and_keeps_its_pictures(tmp_path: Path) -> None:
    file = tmp_path / "a.mp4"
    write_video(file, iter(pictures(65, 47)), 5.0)
    program = shutil.which("ffmpeg") or get_ffmpeg_exe()
    raw = subprocess.run(
        [program, "-loglevel", "error", "-i", file, "-f", "rawvideo", "-pix_fmt", "gray", "-"],
        capture_output=True,
        check=True,
    ).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(3, 48, 66)
    for frame, shade in zip(frames, SHADES, strict=True):
        assert abs(frame[:46, :64].astype(int) - shade).max() < 8


def test_names_and_tools_are_checked_before_anything_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(RfgsError, match=r"a\.gif: expected a file name ending in \.mp4 or \.webp"):
        check_video(Path("a.gif"))
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    said = r"rfgs\[video\].*apt-get install -y ffmpeg.*or name the file a\.webp"
    with pytest.raises(MissingToolError, match=said):
        check_video(Path("a.mp4"))
    with pytest.raises(RfgsError, match="at least one picture"):
        write_video(tmp_path / "a.webp", [], 5.0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("code", "reason"), [(0, "no reason"), (3, "out of ideas")])
def test_a_writer_that_ends_early_leaves_no_video(
    code: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever it says of itself, a film that was cut short is none."""
    said = f"echo {reason} >&2; " if code else ""
    program = tmp_path / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text(f"#!/bin/bash\n{said}exec <&-; exit {code}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    out = tmp_path / "out" / "a.mp4"
    with pytest.raises(RfgsError, match=f"ffmpeg could not write the video: {reason}"):
        write_video(out, iter(pictures(640, 480) * 20), 5.0)
    assert not out.exists()
