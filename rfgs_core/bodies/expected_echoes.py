# SPDX-License-Identifier: Apache-2.0
"""What device pairs hear of somebody at a place who stands or lies, facing any way."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex64, Float64

from rfgs_core.articulated import Pose, people
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.encode.body_maps import CENTRE_HEIGHT_M
from rfgs_core.limbs.evidence import body as evidence
from rfgs_core.limbs.evidence.body import Posed, figure_of, posed
from rfgs_core.limbs.evidence.entries import Pair
from rfgs_core.limbs.evidence.library import about_z, upright
from rfgs_core.worlds.figure import Figure

#: Which way a body faces is not known: it is taken to face both ways [rad].
_HEADINGS_RAD = (0.0, 0.5 * math.pi)
#: Nor is at which end of who lies the head is.
_ENDS_RAD = (0.0, math.pi)
#: From looking along x to lying on the back, the head towards x.
_ON_BACK = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


class ExpectedEchoes(NamedTuple):
    """A body at a place, facing all ways at once."""

    middle: Float64[np.ndarray, "3"]
    """Middle of the body [m]."""
    ways: list[Posed]

    @staticmethod
    def at(one: Bodies, floor_m: float, pairs: list[Pair]) -> ExpectedEchoes:
        """A single body as some pairs see it; who sits is taken to stand."""
        figure = _figure()
        pose = upright(figure.body)
        if one.lies[0]:
            way_rad = float(one.ways[0, 0])
            lying = _about_hips(figure, pose)
            turned = [lying.turned(about_z(way_rad + end)) for end in _ENDS_RAD]
            spot = middle_of(one, floor_m)
        else:
            turned = [pose.turned(about_z(heading)) for heading in _HEADINGS_RAD]
            spot = np.array([*one.axes_xy[0], floor_m])
        ways = [posed(figure, way.moved(spot), pairs) for way in turned]
        return ExpectedEchoes(middle_of(one, floor_m), ways)

    def echoes(
        self, pair: Pair, shift: Float64[np.ndarray, "3"] | None = None
    ) -> Complex64[np.ndarray, "entry entry"]:
        """Covariance of the straight echoes, moved by `shift` [m]."""
        moved = np.zeros(3) if shift is None else shift
        return np.sum([evidence.direct(one, pair, moved) for one in self.ways], axis=0)

    def by_bounces(
        self, pair: Pair, bounds_m: Float64[np.ndarray, "2 3"]
    ) -> Complex64[np.ndarray, "entry entry"]:
        """Covariance of the echoes by way of one wall."""
        images = evidence.images_of(pair, bounds_m, self.middle)
        parts = [evidence.by_bounces(one.facets, pair, images) for one in self.ways]
        return np.sum(parts, axis=0)


def middle_of(one: Bodies, floor_m: float) -> Float64[np.ndarray, "3"]:
    """Middle of a single body [m]."""
    height_m = float(one.ways[0, 1]) if one.lies[0] else CENTRE_HEIGHT_M
    return np.array([*one.axes_xy[0], floor_m + height_m])


def _about_hips(figure: Figure, pose: Pose) -> Pose:
    """Lying on the back, the hips in the origin."""
    return pose.moved(-figure.body.joints17(pose)[0]).turned(_ON_BACK)


@functools.cache
def _figure() -> Figure:
    """The mean body."""
    return figure_of(people().body(np.zeros(0)))
