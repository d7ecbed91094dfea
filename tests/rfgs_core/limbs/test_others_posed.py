# SPDX-License-Identifier: Apache-2.0
"""Echoes of other people are taken off better if these are posed as they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rfgs_core.articulated import Body, Pose, facets_of
from rfgs_core.bodies.localise import pair_maps
from rfgs_core.bodies.separation import each_alone, each_alone_posed
from rfgs_core.limbs.evidence.library import Stride, about_z
from rfgs_core.measure.observations import Observations
from rfgs_core.settings import TrainConfig

#: Two people a metre and a half apart, at other moments of a step.
PLACES, HEADINGS, MOMENTS = np.array([[-0.7, 0.3, 0.0], [0.8, -0.2, 0.0]]), (0.4, 2.5), (2, 7)
ON_EACH = 1500


def test_less_is_left_of_people_who_are_posed(
    heard: Callable[[Pose, float, np.ndarray], Observations], stride: Stride, walker_body: Body
) -> None:
    """Heard through facets of the tracer, explained by Gaussians of the model."""
    steps = [stride.poses[moment] for moment in MOMENTS]
    single = [heard(*row) for row in zip(steps, HEADINGS, PLACES, strict=True)]
    both = single[0].with_delta(single[0].delta + single[1].delta)
    config = TrainConfig(bodies=2)

    def left(alone: list[Observations]) -> np.ndarray:
        """What is left of the other, as a share of its echoes."""
        rows = zip(alone, single, single[::-1], strict=True)
        return np.array(
            [
                np.linalg.norm(one.delta - true.delta) / np.linalg.norm(other.delta)
                for one, true, other in rows
            ]
        )

    def with_skins(poses: list[Pose]) -> np.ndarray:
        rng = np.random.default_rng(0)
        points, normals = [], []
        for pose, heading, place in zip(poses, HEADINGS, PLACES, strict=True):
            posed = pose.turned(about_z(heading)).moved(place)
            skin = facets_of(walker_body.skin(posed), walker_body.faces)
            drawn = rng.choice(len(skin[2]), ON_EACH, p=skin[2] / skin[2].sum())
            points.append(skin[0][drawn])
            normals.append(skin[1][drawn])
        body = np.repeat([0, 1], ON_EACH)
        alone = each_alone_posed(
            both, np.concatenate(points), np.concatenate(normals), body, 2, config
        )
        return left(alone)

    columns = left(each_alone(both, pair_maps(both), PLACES[:, :2], config, 0))
    posed = with_skins(steps)
    # The same number of steps and of Gaussians, but nobody moves a limb.
    at_rest = with_skins([Pose(walker_body.heads[0], walker_body.neutral)] * 2)
    assert (posed < 0.9 * at_rest).all()
    assert posed.max() < 0.5 * columns.min()
