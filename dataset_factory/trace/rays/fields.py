# SPDX-License-Identifier: Apache-2.0
"""Amplitudes of paths whose corners are known: Sionna's field calculator, without its search."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.constants import INVALID_SHAPE
from sionna.rt.path_solvers.field_calculator import FieldCalculator
from sionna.rt.path_solvers.paths_buffer import PathsBuffer

from dataset_factory.scene.bundle import Bundle
from dataset_factory.trace.rays.scene import set_frequency, static_name, vehicle_meshes
from rfgs_core.simulate.geometry import SpecularPaths
from rfgs_core.simulate.surface.movers import Movers


class SceneMeshes:
    """The meshes of a scene from `environment_scene`, one after the other."""

    def __init__(self, bundle: Bundle, vehicles: Movers | None) -> None:
        """Args are those that the scene was made of."""
        static = bundle.static_meshes()
        self._static = [mesh.vertices[mesh.faces].astype(np.float32) for mesh in static]
        self._vehicles = vehicles
        driven = vehicle_meshes(vehicles) if vehicles is not None else []
        self._driven = [faces for _, _, faces in driven]
        self.names = [static_name(index) for index in range(len(static))]
        self.names += [name for name, _, _ in driven]
        #: Which of the meshes move, bool, shape (mesh,).
        self.moves = np.arange(len(self.names)) >= len(static)
        counts = [len(part) for part in [*self._static, *self._driven]]
        self._first = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])

    def triangles(self, vertices: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Corners of all triangles [m], shape (triangle, 3, 3), and the mesh of each.

        Args:
            vertices: Where the vehicles' vertices are [m], shape (V, 3); None for the rest pose.
        """
        parts = list(self._static)
        if self._vehicles is not None:
            places = self._vehicles.rest_vertices if vertices is None else vertices
            parts += [places.astype(np.float32)[faces] for faces in self._driven]
        mesh = np.repeat(np.arange(len(parts)), np.diff(self._first))
        return np.concatenate([np.zeros((0, 3, 3), np.float32), *parts]), mesh

    def located(self, scene: rt.Scene, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shape of each triangle, as Sionna stores it, and the triangle's index in it, uint32.

        Args:
            scene: A scene with these meshes.
            triangles: Triangles, −1 for none.
        """
        pointers = [_pointer(scene, name) for name in self.names]
        mesh = np.searchsorted(self._first, np.maximum(triangles, 0), side="right") - 1
        shape = np.array(pointers or [INVALID_SHAPE], dtype=np.uint32)[mesh]
        index = np.maximum(triangles, 0) - self._first[mesh]
        missing = triangles < 0
        return np.where(missing, np.uint32(INVALID_SHAPE), shape), index.astype(np.uint32)


class Fields:
    """Sends waves along given paths between the antennas of a scene."""

    def __init__(self) -> None:
        """Makes a calculator; what it compiles is used again."""
        self._calculator = FieldCalculator()

    def along(
        self, scene: rt.Scene, meshes: SceneMeshes, found: SpecularPaths, freq_hz: float
    ) -> rt.Paths:
        """The paths at one frequency, as `PathSolver` would give them.

        Args:
            scene: Scene with the antennas that the paths join; its frequency is changed.
            meshes: The scene's meshes.
            found: The paths, over the triangles of the meshes.
            freq_hz: Frequency [Hz].
        """
        set_frequency(scene, freq_hz)
        sources, source_turns, tx_offsets, tx_speeds = scene.sources(True, True)
        targets, target_turns, rx_offsets, rx_speeds = scene.targets(True, True)
        buffer = _buffer(scene, meshes, found)
        arrays: Any = (scene.tx_array, scene.rx_array)
        calculator: Any = self._calculator
        calculator(
            wavelength=scene.wavelength,
            paths=buffer,
            samples_per_src=1,
            diffraction=False,
            src_positions=sources,
            tgt_positions=targets,
            src_orientations=source_turns,
            tgt_orientations=target_turns,
            src_antenna_patterns=arrays[0].antenna_pattern.patterns,
            tgt_antenna_patterns=arrays[1].antenna_pattern.patterns,
        )
        make: Any = rt.Paths
        ends = (sources, targets, tx_speeds, rx_speeds)
        return make(scene, *ends, True, buffer, tx_offsets, rx_offsets)


def _buffer(scene: rt.Scene, meshes: SceneMeshes, found: SpecularPaths) -> PathsBuffer:
    """The paths as Sionna stores them, all of them valid."""
    count, depth = found.kinds.shape
    buffer: Any = PathsBuffer(count, depth, False)
    whole: Any = mi.TensorXu
    real: Any = mi.TensorXf
    shape, triangle = meshes.located(scene, found.triangles)
    buffer._paths_counter = mi.UInt(count)
    buffer.valid = dr.full(mi.Bool, True, count)
    buffer._src_indices = mi.UInt(found.tx.astype(np.uint32))
    buffer._tgt_indices = mi.UInt(found.rx.astype(np.uint32))
    buffer._interaction_types = whole(found.kinds.astype(np.uint32))
    buffer._shapes = whole(shape.astype(np.uint32))
    buffer._primitives = whole(triangle)
    buffer._probs = real(np.ones((count, depth), dtype=np.float32))
    corners = np.moveaxis(found.corners.astype(np.float32), 2, 0)
    buffer._vertices_x, buffer._vertices_y, buffer._vertices_z = (
        real(np.ascontiguousarray(axis)) for axis in corners
    )
    return buffer


def _pointer(scene: rt.Scene, name: str) -> int:
    """The number by which Dr.Jit knows an object's shape."""
    pointer = mi.ShapePtr(scene.objects[name].mi_mesh)
    return int(np.array(dr.reinterpret_array(mi.UInt, pointer)).item())
