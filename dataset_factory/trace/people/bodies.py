# SPDX-License-Identifier: Apache-2.0
"""Everything that moves, in the scene where it is traced: what echoes, shadows and hides."""

from __future__ import annotations

from functools import partial

import numpy as np
import sionna.rt as rt

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.movers import split_movers
from dataset_factory.trace.rays.scene import (
    BODY,
    environment_scene,
    half_space_reflection,
    mesh,
    move_meshes,
    move_vehicles,
    visible,
)
from rfgs_core.radio import Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.simulate.shadow.in_view import segments_in_view
from rfgs_core.simulate.shadow.outline import Outline, coarse_mesh
from rfgs_core.simulate.surface.direct import PosedPoints
from rfgs_core.simulate.surface.points import SurfacePoints, surface_points


class Bodies:
    """People as scattering points, outlines and one absorber; vehicles as metal of the scene."""

    def __init__(self, bundle: Bundle, radio: Radio, seed: int) -> None:
        """Builds the scene, everything that moves in its rest pose.

        Args:
            bundle: Scene bundle.
            radio: Gives the spacing of the points.
            seed: Seed of the points.
        """
        self._bundle = bundle
        self.people, self.vehicles = split_movers(bundle)
        self.scene = environment_scene(bundle, radio, self.vehicles)
        people = self.people
        self._points: SurfacePoints | None = None
        # Vertices kept and triangles of the coarse mesh of each instance.
        self._outlines = [
            coarse_mesh(people.rest_vertices, people.faces[people.instance == instance])
            for instance in np.unique(people.instance)
        ]
        if len(people):
            self._points = surface_points(
                people.rest_vertices,
                people.faces,
                people.material,
                people.instance,
                SPEED_OF_LIGHT / radio.freq_max_hz,
                seed,
                people.edges,
            )
            body = rt.SceneObject(
                mi_mesh=mesh(BODY, people.rest_vertices, people.faces),
                name=BODY,
                radio_material=rt.AbsorberRadioMaterial(name="absorber"),
            )
            self.scene.edit(add=body)

    @property
    def scatter(self) -> bool:
        """Whether anything scatters from points."""
        return self._points is not None

    def points(self, vertices: np.ndarray) -> PosedPoints | None:
        """Scattering points when the bundle's vertices are at places [m], shape (V, 3)."""
        if self._points is None:
            return None
        positions, normals = self._points.at(self.people.posed(vertices))
        return PosedPoints(positions, normals, self._points.areas, self._points.material)

    @property
    def surface(self) -> SurfacePoints | None:
        """The scattering points on the mesh of people; None if there are none."""
        return self._points

    def outlines(self, vertices: np.ndarray, corners: np.ndarray, scene: rt.Scene) -> list[Outline]:
        """What casts the shadow of each person.

        Args:
            vertices: The bundle's vertices [m], shape (V, 3).
            corners: Corners of the paths to be shaded [m], shape (path, corner, 3).
            scene: What hides people from paths, everything in it in place.
        """
        posed = self.people.posed(vertices)
        in_sight = partial(visible, scene.mi_scene)
        return [
            Outline(posed[kept], mesh, segments_in_view(in_sight, corners, posed[kept], mesh.faces))
            for kept, mesh in self._outlines
        ]

    def gamma(self, freq_hz: np.ndarray) -> dict[int, np.ndarray]:
        """Reflection coefficients of all materials that scatter from points, by material index."""
        assert self._points is not None
        return {
            int(index): half_space_reflection(
                self._bundle.materials[int(index)]["radio_material"], freq_hz
            )
            for index in np.unique(self._points.material)
        }

    def move(self, vertices: np.ndarray) -> None:
        """Puts people and vehicles in place, given the bundle's vertices [m], shape (V, 3)."""
        if self.scatter:
            move_meshes(self.scene, {BODY: self.people.posed(vertices)})
        if len(self.vehicles):
            move_vehicles(self.scene, self.vehicles, self.vehicles.posed(vertices))
