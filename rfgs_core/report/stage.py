# SPDX-License-Identifier: Apache-2.0
"""One scene as all its pictures show it: camera, floor, and the surface that colours refer to."""

from __future__ import annotations

import math
from collections.abc import Sequence as Several
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float64
from PIL import Image

from rfgs_core.dataset import Sequence
from rfgs_core.evaluate.baselines import BASELINES, phase_free
from rfgs_core.evaluate.geometry import reference_points, spanned
from rfgs_core.evaluate.grid import Grid
from rfgs_core.evaluate.scene import Scene
from rfgs_core.figures.clouds import MARGIN, as_gaussians, camera_on, draw, floor_of
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.render.cameras import Camera
from rfgs_core.seeds import sub_seed

#: Points of a drawn surface per square metre, and at most.
_POINTS_PER_M2, _MOST_POINTS = 12_000, 150_000
#: Of what moves, every so many points tell where the camera stands.
_THINNED = 20


class Stage(NamedTuple):
    """What all pictures of a scene share."""

    sequence: Sequence
    """The data."""
    surfaces: dict[int, Float64[np.ndarray, "n 3"]]
    """Points of the true surface of each frame, those that scores are told from [m]."""
    camera: Camera
    """Sees the surfaces of all frames."""
    floor: Image.Image
    """The floor through it."""

    def drawn(
        self,
        gaussians: Gaussians,
        frame: int,
        surface: Float64[np.ndarray, "n 3"] | None = None,
    ) -> Image.Image:
        """Gaussians of a frame, coloured by the distance to its surface or to another."""
        near = self.surfaces[frame] if surface is None else surface
        return draw(gaussians, near, self.camera, self.floor)

    def truth(self, frame: int) -> Image.Image:
        """The true surface of a frame."""
        vertices, faces, _ = self.sequence.moving_mesh(frame)
        area_m2 = 0.5 * float(spanned(vertices, faces)[2].sum())
        # Vehicles take more points than scores do, until they look as smooth as people.
        wanted = max(len(self.surfaces[frame]), round(_POINTS_PER_M2 * area_m2))
        count = min(wanted, _MOST_POINTS)
        points = reference_points(vertices, faces, count)
        # Points at random have gaps, which twice the even spacing closes.
        spacing_m = 2.0 * math.sqrt(area_m2 / count)
        return self.drawn(as_gaussians(points, spacing_m), frame, points)

    def voxels(self, points: Float[np.ndarray, "n 3"], frame: int) -> Image.Image:
        """Voxels of the grid that scores are told from, by their centres [m], in a frame."""
        voxel_m = Grid.over(self.sequence.bounds_m).voxel_m
        return self.drawn(as_gaussians(points, voxel_m), frame)


def points_of(scene: Scene, frame: int, baseline: str | None = None) -> Float64[np.ndarray, "n 3"]:
    """Centres of the voxels that a run is scored by, or a baseline that sees what it sees [m]."""
    score = scene.score(frame)
    if baseline is not None:
        evidence = scene.evidence(frame, score)
        found = phase_free.answer(baseline, BASELINES[baseline], evidence, scene.observe).score
        if found is None:
            return np.zeros((0, 3))
        score = found
    return scene.predicted(score)


def staged(sequence: Sequence, frames: Several[int] | None = None, margin: float = MARGIN) -> Stage:
    """The true surfaces of some frames, or of all, and a camera that sees them.

    Args:
        sequence: The data.
        frames: Which frames; None takes all.
        margin: Share of a picture that is left free around the surfaces.

    Raises:
        RfgsError: Nothing that moves has a surface.
    """
    surfaces = {}
    for frame in sequence.frames if frames is None else frames:
        vertices, faces, _ = sequence.moving_mesh(frame)
        seed = sub_seed(0, "reference", frame)
        surfaces[frame] = reference_points(vertices, faces, seed=seed)
    camera = camera_on(np.concatenate([some[::_THINNED] for some in surfaces.values()]), margin)
    return Stage(sequence, surfaces, camera, floor_of(sequence.bounds_m, camera))
