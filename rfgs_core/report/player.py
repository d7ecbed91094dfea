# SPDX-License-Identifier: Apache-2.0
"""True beside fitted over all frames, to be played on the page."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.figures.style import bytes_uri
from rfgs_core.render.side_by_side import to_bytes
from rfgs_core.render.view import camera_of, pictures_of, render_view
from rfgs_core.report.page import Player

#: Longer runs show so many of their frames, evenly spread.
MOST_FRAMES = 48
#: Wider pictures are made smaller [px].
WIDTH_PX = 384
_QUALITY = 82


def player_of(run: EvaluatedRun) -> Player | None:
    """The player of a run, through the first camera that the shader never saw.

    Returns:
        None where the dataset has no pictures.
    """
    unseen = [name for name, _ in pictures_of(run, "test")]
    cameras = [str(row["name"]) for row in run.sequence.cameras]
    if not cameras:
        return None
    name = max(cameras, key=unseen.count)  # the first of those that are wholly held out
    files = run.sequence.files
    there = [frame for frame in run.frames if files.image(name, frame).is_file()]
    if not there:
        return None
    spread = np.linspace(0, len(there) - 1, min(len(there), MOST_FRAMES)).round().astype(int)
    frames = [there[index] for index in np.unique(spread)]
    camera = camera_of(run.sequence, name)
    return Player(
        camera=name,
        seen=unseen.count(name) < len(run.frames),
        frames=frames,
        time_s=[run.sequence.time_s(frame) for frame in frames],
        true=[_uri(run.sequence.image(name, frame)[..., :3]) for frame in frames],
        fitted=[_uri(to_bytes(render_view(run, camera, frame).rgb)) for frame in frames],
    )


def _uri(picture: np.ndarray) -> str:
    image = Image.fromarray(np.ascontiguousarray(picture))
    if image.width > WIDTH_PX:
        image = image.resize((WIDTH_PX, round(image.height * WIDTH_PX / image.width)))
    stream = io.BytesIO()
    image.save(stream, format="JPEG", quality=_QUALITY)
    return bytes_uri(stream.getvalue(), "jpeg")
