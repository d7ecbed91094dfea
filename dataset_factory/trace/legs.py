# SPDX-License-Identifier: Apache-2.0
"""Which walls a ray from a scattering point may reach a device by, found with few ray tests.

Sionna's generator sends its rays and then tests, for every ray and device, whether the device
sees where the ray has hit: tens of millions of shadow rays for a body of 4,000 points. Most of
them tell what is known already, as only the first ray by way of a wall counts. Here rays of one
point are grouped by the wall they hit before any shadow ray is sent, and a group is tested from
its first ray on until one is seen. The candidates are the same, in the same order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from sionna.rt.constants import InteractionType
from sionna.rt.path_solvers.paths_buffer import PathsBuffer
from sionna.rt.path_solvers.sample_data import source_index_per_sample
from sionna.rt.path_solvers.sb_deterministic import SBDeterministicCandidateGenerator
from sionna.rt.utils import fibonacci_lattice, hash_fnv1a, spawn_ray_from_sources

from dataset_factory.trace.leg_groups import NEVER, by_group, grouped, wins

#: Rays of a group that are tested together, round after round.
ROUNDS = (1, 4, 16, 64, 256, 1024)
#: Shadow rays per call, for memory's sake.
TESTS_AT_ONCE = 1 << 22


@dataclass(frozen=True)
class _Hits:
    """Where the rays of all sources have hit; every field has one entry per ray."""

    kind: Any
    """Sionna's code of the interaction."""
    shape: Any
    """Pointer to the shape, as Sionna stores it."""
    primitive: Any
    """Triangle of the shape."""
    place: Any
    """Where [m]."""
    normal: Any
    """Normal of the wall."""
    probability: Any
    """Of the interaction, among those the material has."""
    direction: Any
    """Where the ray was sent."""
    source: Any
    """Which source has sent it."""


class _Chosen:
    """Rays to store, in the form that Sionna's buffer takes samples in.

    No dataclass: Dr.Jit would take its fields for variables of the buffer's loop.
    """

    diffracting_wedges = None

    def __init__(self, hits: _Hits, rays: mi.UInt) -> None:
        self.hits, self.rays = hits, rays

    @property
    def src_indices(self) -> mi.UInt:
        """Sources of the rays."""
        return dr.gather(mi.UInt, self.hits.source, self.rays)

    def get(self, depth: mi.UInt, active: Any) -> tuple[Any, ...]:
        """Kind, shape, primitive, vertex and probability of the rays' one interaction."""
        hits, rays = self.hits, self.rays
        return (
            dr.gather(mi.UInt, hits.kind, rays, active),
            dr.gather(mi.UInt, hits.shape, rays, active),
            dr.gather(mi.UInt, hits.primitive, rays, active),
            dr.gather(mi.Point3f, hits.place, rays, active),
            dr.gather(mi.Float, hits.probability, rays, active),
        )


class LegCandidates(SBDeterministicCandidateGenerator):
    """Sionna's deterministic generator for legs with at most one wall, in far fewer ray tests."""

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
        """Adds candidates to `paths`; called by Sionna with its own arguments."""
        assert max_depth == 1 and not (diffuse_reflection or diffraction or edge_diffraction)
        enabled = InteractionType.SPECULAR * specular_reflection
        enabled += InteractionType.REFRACTION * refraction
        num_sources, num_targets = dr.width(src_positions), dr.width(tgt_positions)
        self._sampler.seed(seed, samples_per_src * num_sources)
        hits, hashes = self._shot(mi_scene, src_positions, samples_per_src, enabled, src_boxes)
        active = np.array(hits.kind) != InteractionType.NONE
        group, groups = grouped(hashes, active, samples_per_src)
        rays, start = by_group(group, groups, samples_per_src)
        first = _first_seen(rays, start, num_targets, _Sight(mi_scene, hits, tgt_positions))
        table = max(max_num_paths_per_src, self.MIN_SPEC_COUNT_SIZE)
        won = wins(first, np.ascontiguousarray(hashes[:, rays[start[:-1]]]), groups, table)
        ray, target = first[won], np.nonzero(won)[1]
        order = np.lexsort((target, ray))
        ray, target = ray[order], target[order]
        before = np.array(paths_counter_per_source).astype(np.int64)
        source = ray // samples_per_src
        # Sources come one after the other, so a place within a source is a difference of places.
        place = np.arange(len(ray)) - np.searchsorted(source, source)
        kept = before[source] + place < max_num_paths_per_src
        ray, target, source = ray[kept], target[kept], source[kept]
        begin = int(np.array(paths.paths_counter).item())
        room = paths.buffer_size - begin
        ray, target, source = ray[:room], target[:room], source[:room]
        if not len(ray):
            return
        self._store(paths, begin, _Chosen(hits, mi.UInt(ray)), mi.UInt(target), tgt_positions)
        dr.scatter_add(paths_counter_per_source, mi.UInt(1), mi.UInt(source))

    def _shot(
        self, mi_scene: Any, sources: mi.Point3f, samples: int, enabled: int, boxes: Any
    ) -> tuple[_Hits, np.ndarray]:
        """Sends all rays; also gives both hashes of each one's wall, uint64, shape (2, ray)."""
        ray = spawn_ray_from_sources(fibonacci_lattice, samples, sources)
        source = source_index_per_sample(dr.width(sources), samples)
        if boxes is not None:
            ray.o, _ = boxes.advance(ray.o, ray.d, source)
        hit = mi_scene.ray_intersect(ray, coherent=True, ray_flags=mi.RayFlags.Minimal, active=True)
        active = hit.is_valid()
        # The same random numbers in the same order as Sionna draws them.
        one, two, three = self._sampler.next_1d(), self._sampler.next_2d(), self._sampler.next_2d()
        allowed = dr.full(mi.UInt, enabled, dr.width(source))
        sample, _, _ = self._sample_radio_material(
            hit, ray.o, ray.d, one, two, three, allowed, False, False, active
        )
        kind = dr.select(active, sample.sampled_component, InteractionType.NONE)
        hashes = []
        for plane in self.plane_hash_functions:
            wall: Any = dr.select(kind == InteractionType.SPECULAR, plane(hit.n, hit.p), kind)
            hashes.append(hash_fnv1a(wall, h=dr.zeros(mi.UInt64, dr.width(source))))
        shape = dr.reinterpret_array(mi.UInt, hit.shape)
        hits = _Hits(kind, shape, hit.prim_index, hit.p, hit.n, sample.pdf, ray.d, source)
        dr.eval(kind, shape, hit.prim_index, hit.p, hit.n, sample.pdf, ray.d, source, hashes)
        return hits, np.stack([np.array(part) for part in hashes])

    def _store(
        self,
        paths: PathsBuffer,
        begin: int,
        chosen: _Chosen,
        target: mi.UInt,
        tgt_positions: mi.Point3f,
    ) -> None:
        """Adds candidates behind those that are there."""
        count = dr.width(target)
        ray = _towards(chosen.hits, chosen.rays, dr.gather(mi.Point3f, tgt_positions, target))
        sent = dr.gather(mi.Vector3f, chosen.hits.direction, chosen.rays)
        where = dr.arange(mi.UInt, count) + dr.opaque(mi.UInt, begin)
        every: Any = dr.full(mi.Bool, True, count)
        with dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, False):
            data: Any = chosen
            paths.add_paths(mi.UInt(1), where, data, mi.Bool(False), target, sent, -ray.d, every)
        paths.advance_paths_counter(dr.opaque(mi.UInt32, count))


@dataclass(frozen=True)
class _Sight:
    """Tells which targets are seen from where rays have hit."""

    mi_scene: Any
    hits: _Hits
    targets: Any

    def __call__(self, rays: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Whether nothing stands between the hit of each ray and its target, bool."""
        seen = np.zeros(len(rays), dtype=bool)
        for i in range(0, len(rays), TESTS_AT_ONCE):
            some = slice(i, i + TESTS_AT_ONCE)
            places = dr.gather(mi.Point3f, self.targets, mi.UInt(target[some]))
            shadow = _towards(self.hits, mi.UInt(rays[some]), places)
            seen[some] = ~np.array(self.mi_scene.ray_test(shadow))
        return seen


def _towards(hits: _Hits, rays: mi.UInt, targets: mi.Point3f) -> mi.Ray3f:
    """Shadow rays from where rays have hit."""
    hit = dr.zeros(mi.SurfaceInteraction3f, dr.width(rays))
    hit.p = dr.gather(mi.Point3f, hits.place, rays)
    hit.n = dr.gather(mi.Normal3f, hits.normal, rays)
    return hit.spawn_ray_to(targets)


def _first_seen(rays: np.ndarray, start: np.ndarray, num_targets: int, sight: _Sight) -> np.ndarray:
    """First ray of each group that each target sees, `NEVER` for none, (group, target)."""
    first = np.full((len(start) - 1, num_targets), NEVER, dtype=np.int64)
    group, target = np.nonzero(first == NEVER)
    done = 0
    for size in _rounds(int(np.diff(start).max(initial=0))):
        begin = start[group] + done
        count = np.minimum(start[group + 1] - begin, size)
        if not len(group):
            break
        ends = np.cumsum(count)
        within = np.arange(ends[-1]) - np.repeat(ends - count, count)
        tested = rays[np.repeat(begin, count) + within]
        seen = sight(tested, np.repeat(target, count))
        best = np.minimum.reduceat(np.where(seen, tested, NEVER), ends - count)
        first[group, target] = best
        done += size
        open_ = (best == NEVER) & (start[group] + done < start[group + 1])
        group, target = group[open_], target[open_]
    return first


def _rounds(longest: int) -> Iterator[int]:
    """Rays to test in each round until the longest group is through."""
    done = 0
    for size in ROUNDS:
        yield size
        done += size
    while done < longest:
        yield ROUNDS[-1]
        done += ROUNDS[-1]
