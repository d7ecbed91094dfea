# SPDX-License-Identifier: Apache-2.0
"""A run beside Gaussians fitted to the pictures themselves: what cameras tell that radio does not.

They see what the run never does, pictures of the very frame from every training camera, and are
judged like the run by pictures of test cameras and by the true surface.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float32

from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.baselines.silhouette import empty_picture, silhouette_picture
from rfgs_core.evaluate.geometry import THRESHOLDS_M, geometry_metrics
from rfgs_core.evaluate.grid import splat_gaussians
from rfgs_core.evaluate.image import Lpips, Picture, image_metrics, mean_person_colour
from rfgs_core.evaluate.pictures import (
    COVERED,
    Values,
    has_pictures,
    mean_of,
    rendered_picture,
    rgb_of,
    true_picture,
)
from rfgs_core.evaluate.scene import EvaluatedRun, Scene
from rfgs_core.render.cameras import Camera
from rfgs_core.render.from_pictures import ColouredGaussians, PersonView, fit_pictures
from rfgs_core.render.rasterizer import splat
from rfgs_core.render.shader import MID_GREY
from rfgs_core.render.view import camera_of
from rfgs_core.seeds import sub_seed

#: What is told of every row; a baseline without Gaussians has no geometry.
KEYS = ("psnr_person", "psnr", "ssim", "lpips", *THRESHOLDS_M)
METHOD, FITTED = "RF-GS", "Gaussians fitted to pictures"


def picture_table(
    run: EvaluatedRun, steps: int, on_step: Callable[[], Any]
) -> dict[str, dict[str, float | None]]:
    """Mean of every frame and test camera, by row.

    Args:
        run: A run on a dataset with pictures.
        steps: Steps of Adam that are fitted to the pictures of each frame.
        on_step: Called after each of them, for a progress bar.

    Raises:
        RfgsError: The dataset holds no pictures, or no camera is kept for testing.
    """
    sequence = run.sequence
    unseen = [str(name) for name in sequence.splits["images"]["test_cameras"]]
    seen = [str(row["name"]) for row in sequence.cameras if row["name"] not in unseen]
    if not has_pictures(run) or not unseen or not seen:
        raise RfgsError(
            f"{sequence.path}: expected pictures of training and of test cameras, found cameras "
            f"{', '.join(seen) or 'none'} and {', '.join(unseen) or 'none'}; generate the dataset "
            "without --no-images"
        )
    scene, lpips = Scene.of(run), Lpips()
    rows: dict[str, list[Values]] = {}
    for frame in run.frames:
        true = {name: true_picture(run, name, frame) for name in seen}
        views = [
            PersonView(camera_of(sequence, name), each.on_grey.astype(np.float32), each.person)
            for name, each in true.items()
        ]
        seed = sub_seed(run.config.settings.seed, "pictures", frame)
        fitted = fit_pictures(
            views, sequence.bounds_m, steps=steps, seed=seed, on_step=lambda _: on_step()
        )
        colour = mean_person_colour(list(true.values()))
        for name in unseen:
            target = true_picture(run, name, frame)
            shown = _shown(run, name, frame, target, colour, fitted)
            for row, picture in shown.items():
                rows.setdefault(row, []).append(image_metrics(target, picture, lpips))
        scores = {METHOD: scene.score(frame), FITTED: _score(scene, fitted)}
        reference = scene.reference(frame)
        for row, score in scores.items():
            found = geometry_metrics(score, scene.grid, reference, scene.voxels)
            rows[row].append({key: found[key] for key in THRESHOLDS_M})
    return {row: mean_of(values, KEYS) for row, values in rows.items()}


def _shown(
    run: EvaluatedRun,
    name: str,
    frame: int,
    target: Picture,
    colour: Float32[np.ndarray, "3"],
    fitted: ColouredGaussians,
) -> dict[str, Picture]:
    """What every row shows of a test camera's view."""
    camera, shown = camera_of(run.sequence, name), {METHOD: rendered_picture(run, name, frame)}
    if run.sequence.files.image_empty(name).is_file():
        empty = rgb_of(run.sequence.image_empty(name))
        shown["empty room"] = empty_picture(empty)
        shown["mean-colour silhouette"] = silhouette_picture(empty, target.person, colour)
        return {**shown, FITTED: _picture(fitted, camera, empty)}
    return {**shown, FITTED: _picture(fitted, camera, np.full_like(target.rgb, MID_GREY))}


def _picture(
    fitted: ColouredGaussians, camera: Camera, behind: Float32[np.ndarray, "h w 3"]
) -> Picture:
    """Gaussians over the empty room, and alone on mid-grey."""
    drawn = splat(fitted.gaussians, fitted.rgb, camera)
    uncovered = 1.0 - drawn.alpha.numpy()[..., None]
    whole, alone = drawn.rgb.numpy() + uncovered * behind, drawn.over(MID_GREY).numpy()
    return Picture(whole.clip(0.0, 1.0), drawn.alpha.numpy() >= COVERED, alone)


def _score(scene: Scene, fitted: ColouredGaussians) -> Float32[np.ndarray, "x y z"]:
    """Opacity in every voxel, as a run's reflected power."""
    gaussians = fitted.gaussians
    return splat_gaussians(
        scene.grid,
        gaussians.means.numpy().astype(np.float64),
        gaussians.covariances.numpy().astype(np.float64),
        gaussians.opacities.numpy().astype(np.float64),
    )
