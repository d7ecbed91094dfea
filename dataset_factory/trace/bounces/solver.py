# SPDX-License-Identifier: Apache-2.0
"""What moving things scatter by way of walls: paths through `RCSSolver`.

All points hang on one tiny sensing target under the floor, a millimetre outside a body that
is an ordinary absorber, so that the body shadows its own points. Sionna scatters with unit
cross-section; the facet is applied afterwards in double precision, with each point's own area
and at every frequency, which the solver could not do. Wall
coefficients are the solver's, of the carrier, and are carried over the band by `walls`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.path_solvers.sb_candidate_generator import SBCandidateGenerator
from sionna.rt.rcs import ConstantCPM, ConstantRCS, RCSSolver, ScatteringModel, SensingTarget

from dataset_factory.trace.bounces.follow import follow
from dataset_factory.trace.bounces.legs import LegCandidates
from dataset_factory.trace.rays.fields import SceneMeshes
from dataset_factory.trace.rays.paths import path_set
from dataset_factory.trace.rays.scene import add_antennas
from rfgs_core.radio import Layout
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import SCATTERING
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.sites import centres, measured_pairs
from rfgs_core.simulate.geometry import Surroundings, mirror_legs
from rfgs_core.simulate.paths.path_set import PathSet, empty, merged
from rfgs_core.simulate.surface.direct import PosedPoints

#: Points per call, for memory's sake; every call compiles kernels for its own path count.
CHUNK = 4096
#: Rays per point with two walls; legs with one are found without rays.
NUM_SAMPLES = 1000
#: Legs with two walls kept per point.
BUFFER = 512
#: Paths weaker than this share of the strongest are left out: facets damped to nothing.
NEGLIGIBLE = 1e-4

#: Places in which a point's legs are told apart, 1 MB of them per point; Sionna's 10⁶ take 8 MB.
#: Of 2¹⁵, legs worth −30 dB of some points' paths were lost to collisions, of 2¹⁶ none.
TABLE = 1 << 17


class JoiningSolver(RCSSolver):
    """`RCSSolver` that finds legs of the same point by sorting.

    The original compares every leg with every other, which grows with the square of the
    number of points and forces chunks of 500; the pairs are the same, less those of sites
    without a measured link.
    """

    def __init__(self, measured: np.ndarray, depth: int) -> None:
        """Takes which pairs of sites are measured, bool, shape (tx, rx), and the depth."""
        super().__init__(deterministic=True)
        self._measured = measured
        if depth == 2:
            self._candidate_generator = self.legs = LegCandidates()

    def _pair_legs(
        self, from_tx_paths: Any, to_rx_paths: Any, max_depth: int
    ) -> tuple[mi.UInt, mi.UInt]:
        """Indices of legs from transmitters and to receivers that make a path."""
        if from_tx_paths.buffer_size == 0 or to_rx_paths.buffer_size == 0:
            return mi.UInt(), mi.UInt()
        at_tx = np.array(from_tx_paths.target_indices).astype(np.int64)
        at_rx = np.array(to_rx_paths.source_indices).astype(np.int64)
        walls_tx = np.array(from_tx_paths.num_interactions()).astype(np.int64)
        walls_rx = np.array(to_rx_paths.num_interactions()).astype(np.int64)
        device_tx = np.array(from_tx_paths.source_indices).astype(np.int64)
        device_rx = np.array(to_rx_paths.target_indices).astype(np.int64)
        order = np.argsort(at_rx, kind="stable")
        first = np.searchsorted(at_rx[order], at_tx, side="left")
        count = np.searchsorted(at_rx[order], at_tx, side="right") - first
        tx = np.repeat(np.arange(len(at_tx)), count)
        within = np.arange(len(tx)) - np.repeat(np.cumsum(count) - count, count)
        rx = order[np.repeat(first, count) + within]
        fits = walls_tx[tx] + walls_rx[rx] + 1 <= max_depth
        fits &= self._measured[device_tx[tx], device_rx[rx]]
        return mi.UInt(tx[fits].astype(np.uint32)), mi.UInt(rx[fits].astype(np.uint32))


@contextmanager
def _small_table() -> Iterator[None]:
    """Sionna with `TABLE` places for each source, which it looks up on the class alone.

    Put back at once: every other solver needs Sionna's own, or it loses paths.
    """
    own = SBCandidateGenerator.MIN_SPEC_COUNT_SIZE
    SBCandidateGenerator.MIN_SPEC_COUNT_SIZE = TABLE
    try:
        yield
    finally:
        SBCandidateGenerator.MIN_SPEC_COUNT_SIZE = own


class Bounces:
    """Traces person paths with at least one wall in them, frame after frame."""

    def __init__(
        self,
        scene: rt.Scene,
        meshes: SceneMeshes,
        layout: Layout,
        devices: list[DevicePose],
        depth: int,
        seed: int,
    ) -> None:
        """Hangs a carrier of scattering points under the scene.

        Args:
            scene: Scene with the moving body in it, without devices.
            meshes: Meshes of the scene, without the body.
            layout: Antenna elements.
            devices: Poses of the devices.
            depth: Interactions per path, the scattering one included: 2 or 3.
            seed: Seed of the rays, the same for every frame.
        """
        self._scene, self._meshes, self._layout = scene, meshes, layout
        self._depth, self._seed = depth, seed
        self._solver = JoiningSolver(measured_pairs(layout), depth)
        self._rcs, self._cpm = ConstantRCS(1.0), ConstantCPM()
        mi_scene: Any = scene.mi_scene
        low = np.array(mi_scene.bbox().min, dtype=np.float64).ravel()
        place: Any = [low[0].item(), low[1].item(), low[2].item() - 1.0]
        origin: Any = [0.0, 0.0, 0.0]
        self._carrier = SensingTarget(
            name="carrier",
            scattering_model=ScatteringModel(origin, rcs=self._rcs, cpm=self._cpm),
            length=1e-3,
            width=1e-3,
            height=1e-3,
            position=place,
        )
        scene.edit(add=self._carrier)
        add_antennas(scene, layout, devices)

    def paths(self, points: PosedPoints, around: Surroundings) -> PathSet:
        """Paths by way of each point and one or more walls, one amplitude each.

        Rays are cast from outside the skin, lengths are those to the skin itself.

        Args:
            points: The points, the body in place.
            around: What the sites see of the faces around, as `Environment.around`.

        Returns:
            Amplitudes are those of points of unit cross-section; `primitives` of the sensing
            interaction is the index of the point.
        """
        # With two walls each point takes a table and room for many legs.
        size = CHUNK if self._depth == 2 else CHUNK // 4
        starts = range(0, len(points.areas), size)
        found = merged([self._chunk(points.lifted[i : i + size], i, around) for i in starts])
        return follow(found, points.positions)

    def _chunk(self, places: np.ndarray, first: int, around: Surroundings) -> PathSet:
        """Paths through a few points; point indices count from `first`."""
        self._hang(places)
        room = BUFFER
        if self._depth == 2:
            legs, sites = mirror_legs(around, places), len(around.tx_xyz) + len(around.rx_xyz)
            room = self._solver.legs.prepare(self._scene, self._meshes, legs, len(places), sites)
        with _small_table():
            paths = self._solver(
                self._scene,
                max_depth=self._depth,
                samples_per_sp=NUM_SAMPLES,
                buffer_size_per_sp=room,
                synthetic_array=True,
                seed=self._seed,
            )
        tx_centres, rx_centres = centres(self._layout)
        found = path_set(paths, tx_centres, rx_centres)
        if not len(found):
            return empty(self._depth)
        found = found.select((found.kinds != 0).sum(axis=1) > 1)
        primitives = np.where(found.kinds == SCATTERING, found.primitives + first, found.primitives)
        return replace(found, primitives=primitives)

    def _hang(self, places: np.ndarray) -> None:
        """Moves the carrier's points to world places [m], shape (point, 3)."""
        centre = np.array(self._carrier.position, dtype=np.float64).ravel()
        x, y, z = (places - centre).astype(np.float32).T
        points = self._carrier.scattering_model.spst
        points.lcs_positions = mi.Point3f(x, y, z)
        zero = np.zeros(len(places), dtype=np.float32)
        points.lcs_orientations = mi.Point3f(zero, zero, zero)
        points.rcs_callables = [self._rcs] * len(places)
        points.cpm_callables = [self._cpm] * len(places)


def with_facets(
    paths: PathSet,
    points: PosedPoints,
    gamma: dict[int, np.ndarray],
    nodes_hz: np.ndarray,
    carrier_hz: float,
) -> PathSet:
    """Replaces the unit cross-section of every path by its facet's.

    Args:
        paths: Paths with one amplitude each, each with one sensing interaction.
        points: Scattering points the paths refer to.
        gamma: Reflection coefficient at the nodes by material index, each of shape (node,).
        nodes_hz: Frequencies of the resulting amplitudes [Hz].
        carrier_hz: Frequency the paths were traced at [Hz].

    Returns:
        Paths of lit facets, one amplitude per node.
    """
    if not len(paths):
        return paths
    at = np.argmax(paths.kinds == SCATTERING, axis=1)
    rows = np.arange(len(paths))
    point = paths.primitives[rows, at]
    corner = paths.vertices[rows, at + 1]
    k_i = _unit(corner - paths.vertices[rows, at])
    k_s = _unit(paths.vertices[rows, at + 2] - corner)
    normal, area = points.normals[point], points.areas[point]
    c_i, c_s = -np.sum(k_i * normal, axis=1), np.sum(k_s * normal, axis=1)
    q_t2 = np.maximum(np.sum((k_s - k_i) ** 2, axis=1) - (c_i + c_s) ** 2, 0.0)
    lit = (c_i > 0.0) & (c_s > 0.0)
    wavenumber = 2.0 * np.pi * nodes_hz / SPEED_OF_LIGHT
    size = np.sqrt(4.0 * np.pi) * area * carrier_hz / SPEED_OF_LIGHT * 0.5 * (c_i + c_s)
    damping = np.exp(-(wavenumber**2) * (q_t2 * area / 24.0)[:, None])
    table = np.zeros((max(gamma) + 1, len(nodes_hz)), dtype=np.complex128)
    for material, coefficient in gamma.items():
        table[material] = coefficient
    facet = 1j * size[:, None] * damping * table[points.material[point]]
    amplitude = paths.amplitude * facet[:, None, :]
    strength = np.abs(amplitude).max(axis=(1, 2)) * lit
    return replace(paths, amplitude=amplitude).select(strength > NEGLIGIBLE * strength.max())


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length one."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
