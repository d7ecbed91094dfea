# SPDX-License-Identifier: Apache-2.0
"""A rendered picture of the run beside the true one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from rfgs_core.render.side_by_side import side_by_side, to_bytes
from rfgs_core.render.view import camera_of, pictures_of, render_view
from rfgs_core.run import Run

#: Pictures narrower than this are enlarged [px].
WIDTH_PX = 640


class Beside(NamedTuple):
    """What a camera sees of a frame."""

    picture: UInt8[np.ndarray, "h w 3"]
    """The run's Gaussians as `rfgs render` draws them; right of them the true picture, if any.

    Enlarged by a whole number where it would be small on a page.
    """
    caption: str
    """What stands where, and whether the shader was fitted to the true picture."""


def beside_true(run: Run, camera: str, frame: int) -> Beside:
    """Renders a frame through a camera of the dataset.

    Raises:
        RfgsError: There is no such camera or frame.
        RfgsFormatError: A file is damaged.
    """
    rendered = to_bytes(render_view(run, camera_of(run.sequence, camera), frame).rgb)
    if not run.sequence.files.image(camera, frame).is_file():
        return Beside(_large(rendered), "rendered; the dataset has no true picture")
    true = run.sequence.image(camera, frame)[..., :3]
    seen = (camera, frame) in pictures_of(run, "train")
    fitted = "the shader was fitted to it" if seen else "the shader never saw it"
    return Beside(_large(side_by_side(rendered, true)), f"left: rendered; right: true, {fitted}")


def _large(picture: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h2 w2 3"]:
    factor = -(-WIDTH_PX // picture.shape[1])
    size = (picture.shape[1] * factor, picture.shape[0] * factor)
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BICUBIC))
