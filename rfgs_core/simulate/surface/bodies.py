# SPDX-License-Identifier: Apache-2.0
"""Facets of people in place, with everything that moves to hide them."""

from __future__ import annotations

import numpy as np

from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.geometry.bvh import build_bvh, refit
from rfgs_core.simulate.surface.movers import Movers
from rfgs_core.simulate.surface.points import LIFT_M, surface_points
from rfgs_core.simulate.surface.posed import Facets

#: Distance by which bodies are held apart while their hierarchy is built [m].
_SPREAD_M = 1e3


class BodySurface:
    """Scattering facets of people, body by body."""

    def __init__(self, people: Movers, vehicles: Movers, radio: Radio, seed: int) -> None:
        """Spreads the facets over the rest pose.

        Args:
            people: What scatters.
            vehicles: What else hides facets.
            radio: Gives the spacing of the facets.
            seed: Seed of the facets.
        """
        self._people, self._vehicles = people, vehicles
        self._points = surface_points(
            people.rest_vertices,
            people.faces,
            people.material,
            people.instance,
            SPEED_OF_LIGHT / radio.freq_max_hz,
            seed,
            people.edges,
        )
        instance = people.instance[self._points.triangle]
        # Neighbours one after the other: they meet the same mirrors and the same triangles.
        places = self._points.at(people.rest_vertices)[0]
        neighbours = build_bvh(np.repeat(places[:, None], 3, axis=1)).triangle
        self._order = neighbours[np.argsort(instance[neighbours], kind="stable")]
        self._body = np.unique(instance[self._order], return_inverse=True)[1]
        self._areas = self._points.areas[self._order]
        self._material = self._points.material[self._order].astype(np.int64)
        self._corners = np.concatenate([people.faces, vehicles.faces + len(people.rest_vertices)])
        rest = np.concatenate([people.rest_vertices, vehicles.rest_vertices]).astype(np.float64)
        # Bodies may rest at one place and move apart: no branch may hold parts of two.
        moved = np.concatenate([people.instance, vehicles.instance])
        shift = _SPREAD_M * np.unique(moved, return_inverse=True)[1]
        self._bvh = build_bvh(rest[self._corners] + shift[:, None, None])

    def facets(self, vertices: np.ndarray) -> Facets:
        """Facets with everything that moves at places [m], shape (V, 3)."""
        posed = self._people.posed(vertices)
        points, normals = self._points.at(posed)
        points, normals = points[self._order], normals[self._order]
        moved = np.concatenate([posed, self._vehicles.posed(vertices)]).astype(np.float64)
        triangles = moved[self._corners]
        return Facets(
            points=points,
            lifted=points + LIFT_M * normals,
            normals=normals,
            areas=self._areas,
            material=self._material,
            body=self._body,
            vertices=moved,
            corners=self._corners,
            triangles=triangles,
            bvh=refit(self._bvh, triangles),
        )
