# SPDX-License-Identifier: Apache-2.0
"""What paths meet: which object stands at each corner, and how fast it moves there."""

from __future__ import annotations

import numpy as np
import sionna.rt as rt

from dataset_factory.scene.bundle import Bundle
from dataset_factory.trace.rays.scene import static_name, vehicle_meshes
from rfgs_core.radio.images import SCATTERING, directions
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.surface.movers import Movers


class CornerObjects:
    """Objects of a scene by the numbers that Sionna has given them."""

    def __init__(self, bundle: Bundle, scene: rt.Scene, vehicles: Movers) -> None:
        """Reads the numbers.

        Args:
            bundle: Gives the objects.
            scene: From `environment_scene` of this bundle.
            vehicles: Those of the bundle, whether or not they are in the scene.
        """
        rows = bundle.path_objects
        self.of_instance = np.zeros(max((r["instance"] for r in rows), default=0) + 1, np.int32)
        for row in rows:
            if row["instance"]:
                self.of_instance[row["instance"]] = row["id"]
        number = {name: int(item.object_id) for name, item in scene.objects.items()}
        self._static: dict[int, int] = {}
        files = [len(row["files"]) for row in bundle.objects if row["files"]]
        for index, row in enumerate(np.repeat(np.arange(len(files)), files)):
            self._static[number[static_name(index)]] = rows[row]["id"]
        self._vehicles = [
            (number[name], faces, vehicles.instance[vehicles.material == material])
            for name, material, faces in vehicle_meshes(vehicles)
            if name in number
        ]

    def ids(self, paths: PathSet) -> np.ndarray:
        """`id` of the object at each corner, int32, shape (path, depth); 0 at scattering points."""
        out = np.zeros(paths.kinds.shape, dtype=np.int32)
        hit = (paths.kinds != 0) & (paths.kinds != SCATTERING)
        for number, row in self._static.items():
            out[hit & (paths.objects == number)] = row
        for number, _, instance in self._vehicles:
            here = hit & (paths.objects == number)
            out[here] = self.of_instance[instance[paths.primitives[here]]]
        return out

    def velocity(self, paths: PathSet, places: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Velocity of what stands at each corner [m/s], shape (path, depth, 3); 0 for points.

        Args:
            paths: The paths.
            places: Where the vehicles' vertices are [m], shape (V, 3).
            velocity: How fast they move [m/s], shape (V, 3).
        """
        from trimesh.triangles import points_to_barycentric

        out = np.zeros((*paths.kinds.shape, 3))
        hit = (paths.kinds != 0) & (paths.kinds != SCATTERING)
        for number, faces, _ in self._vehicles:
            here = hit & (paths.objects == number)
            corners = faces[paths.primitives[here]]
            share = points_to_barycentric(
                places[corners].astype(np.float64), paths.vertices[:, 1:-1][here]
            )
            out[here] = np.einsum("pc,pcx->px", share, velocity[corners])
        return out


def doppler_hz(paths: PathSet, velocity: np.ndarray, wavelength_m: float) -> np.ndarray:
    """Doppler shift of paths between antennas that stand still [Hz], shape (path,).

    The length of a path changes with its corners by Σ v·(k_in − k_out); a corner that slides
    along its plane adds nothing, by Fermat's principle.

    Args:
        paths: The paths.
        velocity: Velocity of what stands at each corner [m/s], shape (path, depth, 3).
        wavelength_m: Wavelength [m].
    """
    k = directions(paths.vertices)
    turns = np.where((paths.kinds != 0)[..., None], k[:, 1:] - k[:, :-1], 0.0)
    return np.sum(velocity * turns, axis=(1, 2)) / wavelength_m
