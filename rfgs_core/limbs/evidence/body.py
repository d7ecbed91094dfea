# SPDX-License-Identifier: Apache-2.0
"""Evidence of one pose in one frame: direct echoes, and echoes by way of one wall."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.articulated import Body, Pose
from rfgs_core.limbs.evidence.entries import End, Pair
from rfgs_core.limbs.evidence.kernel import Facets, Images, covariance
from rfgs_core.worlds.figure import Figure, Skin, look_cell, seen_among, seen_from

#: Facets lie as close as a tracer would set them for this wavelength [m]: phases are random.
WAVELENGTH_M = 0.1
#: Width of the lobe around a facet's normal [rad], wider than without walls.
LOBE_RAD = 0.25
#: Of a body in a wall's mirror every so manieth facet is enough.
_EVERY = 8
#: Echoes by way of a wall that come later than this are told apart by band or direction [m].
_LATEST_M = 6.0


class Posed(NamedTuple):
    """A body in a pose, and what device pairs see of it."""

    facets: Facets
    seen: dict[tuple[int, int], tuple[Bool[np.ndarray, "facet"], Bool[np.ndarray, "facet"]]]
    """Facets that the transmitting and the receiving end of each pair see, by its devices."""


def figure_of(body: Body, wavelength_m: float = WAVELENGTH_M) -> Figure:
    """Facets on a body for its evidence, as close as for some wavelength [m]."""
    return Figure.of(body, wavelength_m)


def posed(figure: Figure, pose: Pose, pairs: list[Pair], *, by_skin: bool = True) -> Posed:
    """A body in a pose as the ends of some pairs see it.

    Args:
        figure: The body and its facets.
        pose: How it holds itself, and where.
        pairs: The pairs.
        by_skin: Whether all triangles of the skin hide facets; else these hide each other, which
            takes half the time and is less exact.
    """
    standing = figure.posed(pose)
    facets = Facets(standing.points, standing.normals, np.sqrt(figure.areas_m2))
    if by_skin:
        skin = Skin(figure.body.skin(pose), figure.body.faces)
        look = functools.partial(seen_from, standing, skin)
    else:
        cell_m = look_cell(len(facets.points), float(figure.areas_m2.sum()))
        look = functools.partial(seen_among, facets.points, facets.normals, cell_m=cell_m)
    looks: dict[tuple[float, ...], Bool[np.ndarray, "facet"]] = {}

    def seen_by(end: End) -> Bool[np.ndarray, "facet"]:
        # Elements of one device lie within millimetres: one look does for them.
        place = tuple(np.round(end.centre, 2).tolist())
        if place not in looks:
            looks[place] = look(end.centre)
        return looks[place]

    return Posed(facets, {pair.devices: (seen_by(pair.tx), seen_by(pair.rx)) for pair in pairs})


def direct(posed: Posed, pair: Pair, shift: np.ndarray) -> Complex64[np.ndarray, "entry entry"]:
    """Covariance of the straight echoes of a posed body, moved a little by `shift` [3] m."""
    return covariance(pair, posed.facets.moved(shift), *posed.seen[pair.devices], LOBE_RAD)


def by_bounces(facets: Facets, pair: Pair, images: Images) -> Complex64[np.ndarray, "entry entry"]:
    """Covariance of the echoes by way of one wall on either leg, every wall a mirror.

    Args:
        facets: The posed surface.
        pair: The pair.
        images: Its ends in the walls, see `images_of`.
    """
    few = facets.thinned(_EVERY)
    seen = np.ones(len(few.points), dtype=bool)
    return covariance(pair, few, seen, seen, LOBE_RAD, images)


def images_of(
    pair: Pair, bounds_m: Float64[np.ndarray, "2 3"], centre: Float64[np.ndarray, "3"]
) -> Images:
    """Images of a pair's ends in the walls, one end and wall at a time, echoes of which count.

    Args:
        pair: The pair.
        bounds_m: Corners of the room [m].
        centre: Middle of the body [m].
    """
    ends = np.array([pair.tx.centre, pair.rx.centre]).T - centre[:, None]
    walls = bounds_m.T - centre[:, None]
    squares = ends**2
    away_m = np.sqrt(squares.sum(axis=0))
    # By axis, wall and end.
    mirrored = (2.0 * walls[:, :, None] - ends[:, None]) ** 2
    late_m = np.sqrt(mirrored + (squares.sum(axis=0) - squares)[:, None]) - away_m
    axis, wall, end = np.nonzero(late_m <= _LATEST_M)
    return Images(end, axis, bounds_m[wall, axis])
