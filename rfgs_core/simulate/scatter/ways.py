# SPDX-License-Identifier: Apache-2.0
"""The ways by which sites reach the facets of one body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.simulate.geometry import Faces
from rfgs_core.simulate.scatter.arrivals import (
    Ends,
    Pictures,
    Slabs,
    by_mirror,
    free_facets,
    straight,
    wanted_facets,
)
from rfgs_core.simulate.scatter.sites import Site
from rfgs_core.simulate.sight.bodies import SIZE, picture
from rfgs_core.simulate.sight.mirrors import Mirror, balls_around, meeting_ball
from rfgs_core.simulate.surface.posed import Facets


class Ways(NamedTuple):
    """What reaches the facets of a body from one port of some sites, way by way."""

    site: np.ndarray
    """Site of each way, int64, shape (way,)."""
    walls: np.ndarray
    """Walls that it meets, int64, shape (way,)."""
    centre: np.ndarray
    """Centre of the array or of its mirror image [m], shape (way, 3)."""
    offset: np.ndarray
    """Elements from there, and their squared distances [m, m²], float32, (way, 4, element)."""
    field: np.ndarray
    """θ and φ of the field, 0 where it does not reach, complex64, shape (way, facet, 2, node)."""
    reaches: np.ndarray
    """Where it does, bool, shape (way, facet)."""


class Body(NamedTuple):
    """One body among everything that moves."""

    facets: Facets
    """Its facets, and everything that moves to hide them."""
    span: slice
    """Where they are among all facets."""
    centre: np.ndarray
    """Centre of a ball around them [m], shape (3,)."""
    radius_m: float
    """Its radius [m]."""
    balls: np.ndarray
    """Balls around groups of them, see `balls_around`."""


class Scope(NamedTuple):
    """What a search for ways needs to know of the radio and the room."""

    faces: Faces
    """What stands still."""
    slabs: Slabs
    """What it is made of."""
    nodes: int
    """Frequencies of the fields."""
    lowest_k: float
    """Lowest wavenumber [rad/m]."""
    size_m: float
    """Size of two arrays together [m]."""
    depth: int
    """Interactions of a path, the facet's included."""


def bodies_of(facets: Facets) -> list[Body]:
    """The bodies that facets belong to."""
    bodies = []
    for body in np.unique(facets.body):
        first, end = np.searchsorted(facets.body, [body, body + 1])
        span = slice(int(first), int(end))
        own = facets._replace(
            points=facets.points[span],
            lifted=facets.lifted[span],
            normals=facets.normals[span],
            areas=facets.areas[span],
            material=facets.material[span],
            body=facets.body[span],
        )
        centre = 0.5 * (own.lifted.min(axis=0) + own.lifted.max(axis=0))
        radius_m = float(np.linalg.norm(own.lifted - centre, axis=1).max()) + 1e-3
        bodies.append(Body(own, span, centre, radius_m, balls_around(own.lifted)))
    return bodies


def pictures_of(bodies: list[Body], place: np.ndarray) -> Pictures:
    """What moves as seen from a place, towards each body."""
    drawn = [
        picture(body.facets.vertices, body.facets.corners, place, body.centre, body.radius_m, SIZE)
        for body in bodies
    ]
    return Pictures(
        np.stack([row.axes for row in drawn]),
        np.array([row.per_pixel for row in drawn]),
        np.stack([row.nearest for row in drawn]),
        np.stack([row.depth for row in drawn]),
    )


def find_ways(
    scope: Scope,
    sites: list[Site],
    partners: list[list[Site]],
    port: int,
    body: Body,
    pictures: list[Pictures],
) -> Ways:
    """What reaches the facets of a body from a port of sites.

    Args:
        scope: The radio and the room.
        sites: The sites.
        partners: Sites at the other end of each site's links.
        port: Which port.
        body: The body.
        pictures: What moves as seen from each site.
    """
    facets, faces = body.facets, scope.faces
    mirrors = [_mirrors(faces, site, body) for site in sites]
    shape = (sum(2 + len(row) for row in mirrors), len(facets.points), 2, scope.nodes)
    field, reaches = np.zeros(shape, dtype=np.complex64), np.zeros(shape[:2], dtype=np.bool_)
    scratch = np.zeros(len(facets.points), np.int64), np.zeros((len(facets.points), 3))
    rows: list[tuple[int, int, np.ndarray, np.ndarray]] = []
    for s, (site, seen, views) in enumerate(zip(sites, pictures, mirrors, strict=True)):
        ends, with_images = _ends(scope, partners[s], body)
        elements, antenna = site.elements[port], site.antennas[port]
        at = len(rows)
        wanted = wanted_facets(facets, site.around.place, with_images)
        count = straight(
            facets,
            seen,
            site.around,
            faces,
            antenna,
            scope.slabs,
            wanted,
            (field[at], reaches[at]),
            (field[at + 1], reaches[at + 1]),
            scope.depth > 1,
        )
        rows.append((s, 0, site.around.place, elements))
        if count[1]:
            rows.append((s, 1, site.around.place, elements))
        for view in views:
            found = free_facets(facets, body.balls, ends, site.around, faces, view, scratch)
            onto = field[len(rows)], reaches[len(rows)]
            if len(found[0]) and by_mirror(
                facets, found, seen, site.around, faces, view, antenna, scope.slabs, onto
            ):
                rows.append((s, 1, view.image, _images(faces, view.face, elements)))
    return Ways(
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        np.stack([row[2] for row in rows]),
        np.stack([_offsets(xyz, centre) for _, _, centre, xyz in rows]),
        field[: len(rows)],
        reaches[: len(rows)],
    )


def _ends(scope: Scope, partners: list[Site], body: Body) -> tuple[Ends, Ends]:
    """The other ends of a site's links, and these together with their mirror images."""
    places = np.array([other.around.place for other in partners]).reshape(-1, 3)
    images = [view.image for other in partners for view in _mirrors(scope.faces, other, body)]
    both = np.concatenate([places, np.array(images).reshape(-1, 3)])
    return (
        Ends(places, scope.lowest_k, scope.size_m),
        Ends(both, scope.lowest_k, scope.size_m),
    )


def _mirrors(faces: Faces, site: Site, body: Body) -> list[Mirror]:
    """Mirrors by way of which a site may see a body."""
    face = np.array([view.face for view in site.mirrors], dtype=np.int64)
    image = np.array([view.image for view in site.mirrors]).reshape(-1, 3)
    found = meeting_ball(faces, face, image, body.centre, body.radius_m)
    return [site.mirrors[index] for index in found]


def _images(faces: Faces, face: int, elements: np.ndarray) -> np.ndarray:
    """Mirror images of elements [m], shape (3, element)."""
    normal, offset = faces.normal[face], faces.offset[face]
    return elements - 2.0 * normal[:, None] * (normal @ elements - offset)


def _offsets(elements: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Elements from their centre and squared distances from it, float32, shape (4, element)."""
    offset = elements - centre[:, None]
    return np.concatenate([offset, (offset**2).sum(axis=0, keepdims=True)]).astype(np.float32)
