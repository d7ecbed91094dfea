# SPDX-License-Identifier: Apache-2.0
"""Whether places that a user names lie in the scene, and in free air there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rfgs_core.dataset import Sequence
from rfgs_core.errors import RfgsError
from rfgs_core.radio.check import enclosed

#: Places may lie this far outside the bounds [m]: outdoors the bounds end where the objects do.
MARGIN_M = 1.0
#: Nearer than this to the bounds is as good as inside [m].
UNTOLD_M = 0.05


def check_in_scene(
    sequence: Sequence,
    named: list[tuple[str, Float[np.ndarray, "3"]]],
    in_air: Float[np.ndarray, "point 3"],
) -> list[str]:
    """Refuses places far outside the scene, and places inside of what stands in it.

    Bounds are all that is known of a scene without geometry. Walls of a single sheet have no
    inside, so that only closed objects are told.

    Args:
        sequence: The scene.
        named: Places [m], each with the option that named it.
        in_air: Points that are known to be in free air [m]: what encloses one is a room.

    Returns:
        A sentence for each place that is outside the scene, but not far.

    Raises:
        RfgsError: Naming the place, and the bounds or the object's extent.
    """
    bounds_m, said = sequence.bounds_m, []
    for option, place in named:
        beyond_m = float(np.linalg.norm(place - np.clip(place, *bounds_m)))
        if beyond_m < UNTOLD_M:
            continue
        sentence = (
            f"{option} {spelt(place)}: {beyond_m:.1f} m outside the scene, which reaches from "
            f"{spelt(bounds_m[0])} to {spelt(bounds_m[1])} m"
        )
        if beyond_m > MARGIN_M:
            raise RfgsError(
                f"{sentence}; expected a place in it, or at most {MARGIN_M:g} m outside"
            )
        said.append(sentence)
    if not sequence.files.static_mesh.is_file():
        return said
    places = np.stack([place for _, place in named]).astype(np.float64)
    for vertices, faces in _closed_parts(*sequence.static_mesh()):
        inside = enclosed(places, bounds_m, vertices, faces)
        if inside.any() and not enclosed(in_air, bounds_m, vertices, faces).any():
            option, place = named[int(np.argmax(inside))]
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            raise RfgsError(
                f"{option} {spelt(place)}: inside an object that reaches from {spelt(low)} to "
                f"{spelt(high)} m; expected a place in free air, move the antenna out of it"
            )
    return said


def spelt(place: Float[np.ndarray, "3"]) -> str:
    """A place as a user writes it, to the millimetre."""
    return ",".join(f"{round(float(value), 3) + 0.0:g}" for value in place)


def _closed_parts(
    vertices: Float[np.ndarray, "vertex 3"], faces: Int[np.ndarray, "face 3"]
) -> Iterator[tuple[Float[np.ndarray, "vertex 3"], Int[np.ndarray, "face 3"]]]:
    """Connected parts of a mesh in which every edge joins two triangles."""
    if not len(faces):
        return
    start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    graph = coo_matrix((np.ones(len(start)), (start, end)), shape=(len(vertices),) * 2)
    part = connected_components(graph, directed=False)[1][faces[:, 0]]
    order = np.argsort(part, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        own, corner = np.unique(faces[rows], return_inverse=True)
        triangles = corner.reshape(-1, 3)
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        _, count = np.unique(edges.reshape(-1, 2), axis=0, return_counts=True)
        if (count == 2).all():
            yield vertices[own], triangles
