# SPDX-License-Identifier: Apache-2.0
"""Which walls a scattering point may reach a device by: every face tried, for Sionna to judge.

Sionna's generator sends rays and keeps as many walls of each point as fit into a buffer: with a
thousand rays a furnished room loses small faces, with four thousand it overflows, and the two
differ by −14 dB. Here every face that a device sees is tried for every point by its image, and
the straight way through one wall besides; Sionna's image method then tells which hold.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.constants import InteractionType
from sionna.rt.path_solvers.paths_buffer import PathsBuffer
from sionna.rt.path_solvers.sb_deterministic import SBDeterministicCandidateGenerator

from dataset_factory.trace.rays.fields import SceneMeshes
from rfgs_core.simulate.geometry import Legs


class _Candidates:
    """Candidates in the form that Sionna's buffer takes samples in.

    No dataclass: Dr.Jit would take its fields for variables of the buffer's loop.
    """

    diffracting_wedges = None

    def __init__(
        self,
        points: np.ndarray,
        kinds: np.ndarray,
        shapes: np.ndarray,
        primitives: np.ndarray,
        places: np.ndarray,
    ) -> None:
        """Args are the point, interaction, shape, triangle and corner of each candidate."""
        self.src_indices = mi.UInt(points.astype(np.uint32))
        place = mi.Point3f(*np.ascontiguousarray(places.T, dtype=np.float32))
        kind, shape, primitive = (mi.UInt(v.astype(np.uint32)) for v in (kinds, shapes, primitives))
        self._fields = kind, shape, primitive, place, dr.ones(mi.Float, len(points))

    def get(self, depth: mi.UInt, active: Any) -> tuple[Any, ...]:
        """Kind, shape, primitive, vertex and probability of the one interaction of each."""
        return self._fields


class LegCandidates(SBDeterministicCandidateGenerator):
    """Gives Sionna's solver legs that were found beforehand, instead of sending rays."""

    def __init__(self) -> None:
        """Has no legs until `prepare`."""
        super().__init__()
        self._candidates: _Candidates | None = None
        self._targets = np.zeros(0, dtype=np.int64)

    def prepare(
        self, scene: rt.Scene, meshes: SceneMeshes, legs: Legs, points: int, sites: int
    ) -> int:
        """Takes the legs of the next call, and adds each point's straight way to each device.

        Args:
            scene: Scene that is traced.
            meshes: Its meshes.
            legs: Legs by one mirror.
            points: Number of points.
            sites: Number of devices' sites.

        Returns:
            Room in the solver's buffer that is needed for each point.
        """
        straight = np.arange(points * sites)
        point = np.concatenate([legs.point, straight // sites])
        self._targets = np.concatenate([legs.site, straight % sites])
        kinds = np.full(len(point), int(InteractionType.SPECULAR))
        kinds[len(legs.point) :] = int(InteractionType.REFRACTION)
        # Whichever wall is crossed is found when the way is tested; any triangle stands for it.
        triangle = np.concatenate([legs.triangle, np.zeros(len(straight), dtype=np.int64)])
        place = np.concatenate([legs.place, np.zeros((len(straight), 3))])
        shape, primitive = meshes.located(scene, triangle)
        self._candidates = _Candidates(point, kinds, shape, primitive, place)
        # Lines of sight take room before these.
        return sites + -(-len(point) // points)

    def _shoot_and_bounce(
        self,
        mi_scene: Any,
        src_positions: mi.Point3f,
        tgt_positions: mi.Point3f,
        paths: PathsBuffer,
        samples_per_src: int,
        max_num_paths_per_src: int,
        max_depth: int,
        paths_counter_per_source: mi.UInt,
        specular_reflection: bool,
        diffuse_reflection: bool,
        refraction: bool,
        diffraction: bool,
        edge_diffraction: bool,
        seed: int,
        src_boxes: Any = None,
    ) -> None:
        """Adds the candidates to `paths`; called by Sionna with its own arguments."""
        assert max_depth == 1 and not (diffuse_reflection or diffraction or edge_diffraction)
        assert self._candidates is not None
        count = len(self._targets)
        begin = int(np.array(paths.paths_counter).item())
        assert begin + count <= paths.buffer_size
        where = dr.arange(mi.UInt, count) + dr.opaque(mi.UInt, begin)
        every: Any = dr.full(mi.Bool, True, count)
        # Directions are set by the image method.
        nowhere = dr.zeros(mi.Vector3f, count)
        data: Any = self._candidates
        target = mi.UInt(self._targets.astype(np.uint32))
        with dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, False):
            paths.add_paths(
                mi.UInt(1), where, data, mi.Bool(False), target, nowhere, nowhere, every
            )
        paths.advance_paths_counter(dr.opaque(mi.UInt32, count))
