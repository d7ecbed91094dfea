# SPDX-License-Identifier: Apache-2.0
"""Turns what Blender rendered into the dataset's pictures, free of dates and host names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.pictures import read_exr, read_png_rgba, write_png
from rfgs_core.dataset.writer import write_picture
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import write_json

#: Blender writes 1e10 where a ray hits nothing [m].
FAR_M = 1e9


def encode_frame(rendered: Path, files: SequenceFiles, cameras: list[str], frame: int) -> None:
    """Encodes one frame of every camera, then writes its marker.

    Args:
        rendered: Folder with `cam00/000001.png` and `.exr` from the add-on.
        files: Where the pictures go.
        cameras: Camera names.
        frame: Frame number.

    Raises:
        RfgsFormatError: A picture or one of its passes is missing or damaged.
    """
    for camera in cameras:
        stem = rendered / camera / f"{frame:06d}"
        image = read_png_rgba(stem.with_suffix(".png"))
        passes = read_exr(stem.with_suffix(".exr"))
        exr = stem.with_suffix(".exr")
        depth = _pass(exr, passes, "Depth.Z", "Depth.V", "Z.V", "Depth")
        index = _pass(exr, passes, "Object Index.X", "IndexOB.X", "Object Index.V", "IndexOB")
        normal = np.stack(
            [_pass(exr, passes, f"Normal.{axis}") for axis in "XYZ"],
            axis=-1,
        )
        write_picture(
            files,
            camera,
            frame,
            image=image,
            depth=np.where(depth > FAR_M, np.inf, depth).astype(np.float32),
            normal=normal,
            mask=np.rint(index).astype(np.uint16),
        )
    write_json(files.images_done(frame), {"cameras": cameras})


def encode_empty(rendered: Path, files: SequenceFiles, cameras: list[str]) -> None:
    """Encodes the pictures without anything that moves."""
    for camera in cameras:
        write_png(files.image_empty(camera), read_png_rgba(rendered / camera / "empty.png"))


def rendered_whole(rendered: Path, cameras: list[str], frame: int) -> bool:
    """Whether every camera's picture of a frame exists."""
    return all(
        (rendered / camera / f"{frame:06d}{suffix}").is_file()
        for camera in cameras
        for suffix in (".png", ".exr")
    )


def _pass(path: Path, passes: dict[str, np.ndarray], *names: str) -> np.ndarray:
    for name in names:
        for stored, plane in passes.items():
            if stored == name or stored.endswith(f".{name}"):
                return plane
    raise RfgsFormatError(
        f"{path}: expected a pass {names[0]}, found {', '.join(sorted(passes)) or 'none'}"
    )
