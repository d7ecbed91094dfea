# SPDX-License-Identifier: Apache-2.0
"""Image group of a run and of its picture baselines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from rfgs_core.evaluate.baselines.silhouette import empty_picture, silhouette_picture
from rfgs_core.evaluate.image import (
    IMAGE_KEYS,
    Lpips,
    Picture,
    image_metrics,
    mean_person_colour,
)
from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.render.view import pictures_of, render_person, render_view

#: A pixel shows the person if Gaussians cover at least this share of it.
COVERED = 0.5

Values = dict[str, float | None]


def true_picture(run: EvaluatedRun, camera: str, frame: int) -> Picture:
    """The picture of the dataset, cut with its instance mask."""
    return Picture.cut(
        rgb_of(run.sequence.image(camera, frame)), run.sequence.mask(camera, frame) > 0
    )


def rendered_picture(run: EvaluatedRun, camera: str, frame: int) -> Picture:
    """The run's Gaussians in the room, and alone on mid-grey."""
    alone = render_person(run, camera, frame)
    return Picture(render_view(run, camera, frame).rgb, alone.alpha >= COVERED, alone.rgb)


def has_pictures(run: EvaluatedRun) -> bool:
    """Whether the dataset holds pictures of what the run was trained on."""
    cameras = run.sequence.cameras
    files = run.sequence.files
    return bool(cameras) and files.image(cameras[0]["name"], run.frames[0]).is_file()


def picture_metrics(
    run: EvaluatedRun, on_picture: Callable[[], Any]
) -> tuple[dict[str, Values], dict[str, str]]:
    """Mean image metrics over the pictures that the shader never saw.

    Args:
        run: The run; the dataset holds pictures.
        on_picture: Called after each picture, for a progress bar.

    Returns:
        Groups of `method`, `empty_room` and `silhouette`, and reasons for values that are None.
    """
    lpips = Lpips()
    training = [true_picture(run, *which) for which in pictures_of(run, "train")]
    colour = mean_person_colour(training)
    rows: dict[str, list[Values]] = {"method": [], "empty_room": [], "silhouette": []}
    for camera, frame in pictures_of(run, "test"):
        true = true_picture(run, camera, frame)
        shown = {"method": rendered_picture(run, camera, frame)}
        if run.sequence.files.image_empty(camera).is_file():
            empty = rgb_of(run.sequence.image_empty(camera))
            shown["empty_room"] = empty_picture(empty)
            shown["silhouette"] = silhouette_picture(empty, true.person, colour)
        for name, picture in shown.items():
            rows[name].append(image_metrics(true, picture, lpips))
        on_picture()
    reasons = {}
    groups = {name: mean_of(values, IMAGE_KEYS) for name, values in rows.items()}
    for name, values in rows.items():
        if not values:
            reasons[name] = "there is no picture of the empty room, or none the shader did not see"
    if lpips.reason:
        reasons["lpips"] = lpips.reason
    return groups, reasons


def mean_of(rows: list[Values], keys: tuple[str, ...]) -> Values:
    """Mean of each key over the rows that have it, None if none has."""
    result: dict[str, Any] = {}
    for key in keys:
        known = [row[key] for row in rows if row.get(key) is not None]
        result[key] = float(np.mean(np.asarray(known, dtype=np.float64))) if known else None
    return result


def rgb_of(picture: np.ndarray) -> Float[np.ndarray, "h w 3"]:
    """Colours of a stored picture, sRGB in [0, 1]."""
    return picture[..., :3].astype(np.float32) / np.float32(255.0)
