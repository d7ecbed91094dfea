# SPDX-License-Identifier: Apache-2.0
"""A rendered picture of the run beside the true one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8

from rfgs_core.render.side_by_side import WIDTH_PX, enlarged, side_by_side, to_bytes
from rfgs_core.render.view import camera_of, pictures_of, render_view
from rfgs_core.run import Run


class ComparedPicture(NamedTuple):
    """What a camera sees of a frame."""

    picture: UInt8[np.ndarray, "h w 3"]
    """The run's Gaussians as `rfgs render` draws them; right of them the true picture, if any.

    Enlarged by a whole number where it would be small on a page.
    """
    caption: str
    """What stands where, and whether the shader was fitted to the true picture."""


def rendered_and_true(run: Run, camera: str, frame: int) -> ComparedPicture:
    """Renders a frame through a camera of the dataset.

    Raises:
        RfgsError: There is no such camera or frame.
        RfgsFormatError: A file is damaged.
    """
    rendered = to_bytes(render_view(run, camera_of(run.sequence, camera), frame).rgb)
    if not run.sequence.files.image(camera, frame).is_file():
        return ComparedPicture(
            enlarged(rendered, WIDTH_PX), "rendered; the dataset has no true picture"
        )
    true = run.sequence.image(camera, frame)[..., :3]
    seen = (camera, frame) in pictures_of(run, "train")
    fitted = "the shader was fitted to it" if seen else "the shader never saw it"
    both = enlarged(side_by_side(rendered, true), WIDTH_PX)
    return ComparedPicture(both, f"left: rendered; right: true, {fitted}")
