# SPDX-License-Identifier: Apache-2.0
"""Channel state information of a scene bundle, frame by frame."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

import drjit as dr
import numpy as np
import sionna.rt as rt

from dataset_factory.bundle import Bundle, BundleFrame
from dataset_factory.motion import read_motion
from dataset_factory.trace.bounces import BUFFER, Bounces, with_facets
from dataset_factory.trace.direct import PosedPoints, direct_channel, in_sight
from dataset_factory.trace.environment import (
    Environment,
    environment_channel,
    node_frequencies,
)
from dataset_factory.trace.held import Trace, follow, mixed
from dataset_factory.trace.movers import split_movers
from dataset_factory.trace.paths import PathSet
from dataset_factory.trace.points import SurfacePoints, surface_points
from dataset_factory.trace.scene import (
    BODY,
    check_materials,
    environment_scene,
    half_space_reflection,
    mesh,
    move_meshes,
    move_vehicles,
)
from dataset_factory.trace.shadow import Shadow, coarse_mesh, transmission
from dataset_factory.trace.steering import steer
from rfgs_core.errors import RfgsError
from rfgs_core.radio import Radio, frame_samples, layout, pose_span_s
from rfgs_core.radio.check import too_deep
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import DevicePose
from rfgs_core.seeds import sub_seed

#: Longest time between traces of a frame with several samples [s].
TRACE_STEP_S = 0.02
#: Dr.Jit keeps kernels and memory of every frame; they are dropped this often [frames].
FLUSH_EVERY = 10


class Tracer:
    """Traces one radio through one bundle: H = H_environment · shadow + H_people.

    Vehicles are part of the environment, which is traced again for every frame if there are any.

    Example:
        tracer = Tracer(bundle, preset("wifi"), devices)
        csi = tracer.frame(bundle.frame(1))
    """

    def __init__(
        self,
        bundle: Bundle,
        radio: Radio,
        devices: list[DevicePose],
        *,
        depth: int = 2,
        shadow: Shadow = "kirchhoff",
        seed: int = 0,
    ) -> None:
        """Builds the scenes; tracing starts with the first call.

        Args:
            bundle: Scene bundle.
            radio: Radio to simulate.
            devices: Poses of its devices.
            depth: Interactions of people's paths: 1 direct, 2 with one wall, 3 with two.
            shadow: "kirchhoff", or "hard" for Sionna's all-or-nothing shadow.
            seed: Root seed; rays and points depend on it, frames do not.

        Raises:
            RfgsError: A material does not hold in the radio's band, or the depth is not 1, 2
                or 3.
        """
        if depth != 1 and depth not in BUFFER:
            raise RfgsError(f"trace depth {depth}: expected 1, 2 or 3")
        if depth > radio.deepest:
            raise RfgsError(too_deep(radio, depth))
        check_materials(bundle, radio)
        self._bundle, self._radio, self._devices = bundle, radio, devices
        self._shadow: Shadow = shadow
        self._seed = seed
        self._layout = layout(radio, devices)
        self._samples = frame_samples(radio, bundle.fps)
        self._nodes = node_frequencies(radio)
        self.timings: dict[str, float] = dict.fromkeys(
            ("environment", "shadow", "people_direct", "people_bounces"), 0.0
        )
        self._people, self._vehicles = split_movers(bundle)
        rays = sub_seed(seed, "environment")
        with self._timed("environment"):
            environment = Environment(bundle, radio, self._layout, devices, rays)
            self._static_paths = environment.paths()
            if len(self._vehicles):
                environment = Environment(
                    bundle, radio, self._layout, devices, rays, self._vehicles
                )
        self._environment = environment
        self._frames_done = 0
        self._points = self._make_points()
        self._outlines = self._make_outlines()
        self._scene = environment_scene(bundle, radio, self._vehicles)
        self._bounces: Bounces | None = None
        if self._points is not None:
            self._add_body()
            if depth > 1:
                self._bounces = Bounces(
                    self._scene, self._layout, devices, depth, sub_seed(seed, "bounces")
                )

    def static(self) -> np.ndarray:
        """Channel without anything that moves, complex64, shape (tx, rx, subcarrier)."""
        channel = environment_channel(self._static_paths, self._radio, self._layout)
        return channel.astype(np.complex64)

    def samples(self, frame: BundleFrame) -> np.ndarray:
        """Channels at every sample of a frame, complex64, shape (sample, tx, rx, subcarrier).

        The first is `frame`'s. For the others the scene is traced every `TRACE_STEP_S` at most;
        in between, points and facets are where the animation has them, with exact path lengths,
        while visibility, walls met and shadows fade from one trace to the next. Where there are
        vehicles, the environment is traced again for every sample.
        """
        offset_s = self._samples.offset_s
        first = self._trace(frame.vertices)
        channel = self._channel(first.points, (first,), (1.0,))
        out = np.zeros((len(offset_s), *channel.shape), dtype=np.complex64)
        out[0] = channel
        span_s = pose_span_s(self._radio)
        if span_s is None:
            return out
        motion = read_motion(self._bundle, frame.frame, span_s)
        parts = max(1, math.ceil(offset_s[-1] / TRACE_STEP_S - 1e-9))
        before, after, part = first, first, 0
        for k, time_s in enumerate(offset_s[1:], start=1):
            progress = time_s / offset_s[-1] * parts
            while part < progress and part < parts:
                part += 1
                before = after
                after = self._trace(motion.at(offset_s[-1] * part / parts))
            share = 1.0 - part + progress
            pose = motion.at(time_s)
            environment = self._environment_at(pose) if len(self._vehicles) else None
            shares = (1.0 - share, share)
            out[k] = self._channel(self._posed(pose), (before, after), shares, environment)
        return out

    def frame(self, frame: BundleFrame) -> np.ndarray:
        """Channel at one frame; the result does not depend on frames traced before.

        Args:
            frame: What moves, in place.

        Returns:
            Complex64, shape (tx, rx, subcarrier), zero where a link is not measured.
        """
        trace = self._trace(frame.vertices)
        return self._channel(trace.points, (trace,), (1.0,)).astype(np.complex64)

    def _trace(self, vertices: np.ndarray) -> Trace:
        """Everything that needs rays, with everything that moves in place.

        Args:
            vertices: Vertices of the bundle [m], shape (V, 3).
        """
        vertices = vertices.astype(np.float32)
        environment = self._environment_at(vertices)
        self._flush()
        if self._points is None:
            return Trace(environment)
        self._move(vertices)
        points = self._posed(vertices)
        assert points is not None
        with self._timed("people_direct"):
            seen = in_sight(self._scene.mi_scene, points, self._layout)
        bounced = None
        if self._bounces is not None:
            with self._timed("people_bounces"):
                bounced = self._bounces.paths(points)
        return Trace(environment, points, seen, bounced)

    def _environment_at(self, vertices: np.ndarray) -> np.ndarray:
        """Channel of everything but people's echoes, complex128, (tx, rx, subcarrier)."""
        vertices = vertices.astype(np.float32)
        paths = self._paths_at(vertices)
        passed = None
        if self._points is not None:
            people = self._people.posed(vertices)
            bodies = [(people[kept], faces) for kept, faces in self._outlines]
            with self._timed("shadow"):
                passed = transmission(paths, self._layout, bodies, self._nodes, self._shadow)
        with self._timed("environment"):
            return environment_channel(paths, self._radio, self._layout, passed)

    def _channel(
        self,
        points: PosedPoints | None,
        traces: tuple[Trace, ...],
        shares: tuple[float, ...],
        environment: np.ndarray | None = None,
    ) -> np.ndarray:
        """Channel of points in a mixture of traces, complex128, (tx, rx, subcarrier).

        Args:
            points: Scattering points; None if there are none.
            traces: What rays have told.
            shares: Weight of each trace.
            environment: Channel without people's echoes; None mixes that of the traces.
        """
        weighted = list(zip(traces, shares, strict=True))
        if environment is None:
            environment = mixed([(trace.environment, share) for trace, share in weighted])
        channel = environment
        if points is not None:
            with self._timed("people_direct"):
                channel += direct_channel(
                    points,
                    mixed([(trace.seen, share) for trace, share in weighted]),
                    self._layout,
                    self._devices,
                    self._gamma(self._radio.freq_hz),
                    self._radio,
                )
            for trace, share in weighted:
                if share and trace.bounced is not None:
                    with self._timed("people_bounces"):
                        channel += share * self._bounced(points, trace)
        channel[~self._layout.measured] = 0.0
        return channel

    def _paths_at(self, vertices: np.ndarray) -> PathSet:
        """Paths without people when the bundle's vertices are at places [m], shape (V, 3)."""
        if not len(self._vehicles):
            return self._static_paths
        with self._timed("environment"):
            return self._environment.paths(self._vehicles.posed(vertices))

    def _bounced(self, points: PosedPoints, trace: Trace) -> np.ndarray:
        """People's paths by way of walls, shape (tx, rx, subcarrier)."""
        assert trace.bounced is not None
        paths = trace.bounced
        if points is not trace.points:
            paths = follow(paths, points.lifted)
        paths = with_facets(
            paths, points, self._gamma(self._nodes), self._nodes, self._radio.centre_hz
        )
        return steer(paths, self._layout, self._radio.freq_hz, self._nodes)

    def _posed(self, vertices: np.ndarray) -> PosedPoints | None:
        """Scattering points when the bundle's vertices are at places [m], shape (V, 3)."""
        if self._points is None:
            return None
        positions, normals = self._points.at(self._people.posed(vertices))
        return PosedPoints(positions, normals, self._points.areas, self._points.material)

    def _gamma(self, freq_hz: np.ndarray) -> dict[int, np.ndarray]:
        """Reflection coefficients of all materials that move, by material index."""
        assert self._points is not None
        return {
            int(index): half_space_reflection(
                self._bundle.materials[int(index)]["radio_material"], freq_hz
            )
            for index in np.unique(self._points.material)
        }

    def _make_points(self) -> SurfacePoints | None:
        """Points on everything that scatters from points; None if nothing does."""
        people = self._people
        if not len(people):
            return None
        return surface_points(
            people.rest_vertices,
            people.faces,
            people.material,
            people.instance,
            SPEED_OF_LIGHT / self._radio.freq_max_hz,
            sub_seed(self._seed, "points"),
        )

    def _make_outlines(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Vertices kept and triangles of the coarse mesh of each instance."""
        people = self._people
        return [
            coarse_mesh(people.rest_vertices, people.faces[people.instance == instance])
            for instance in np.unique(people.instance)
        ]

    def _add_body(self) -> None:
        """Adds everything that scatters from points as one absorber, in its rest pose."""
        body = rt.SceneObject(
            mi_mesh=mesh(BODY, self._people.rest_vertices, self._people.faces),
            name=BODY,
            radio_material=rt.AbsorberRadioMaterial(name="absorber"),
        )
        self._scene.edit(add=body)

    def _move(self, vertices: np.ndarray) -> None:
        """Puts people and vehicles in place, given the bundle's vertices [m], shape (V, 3)."""
        move_meshes(self._scene, {BODY: self._people.posed(vertices)})
        if len(self._vehicles):
            move_vehicles(self._scene, self._vehicles, self._vehicles.posed(vertices))

    def _flush(self) -> None:
        """Drops what Dr.Jit keeps of past frames, every few frames."""
        self._frames_done += 1
        if self._frames_done % FLUSH_EVERY == 0:
            dr.flush_kernel_cache()
            dr.flush_malloc_cache()

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        """Adds the block's wall time to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.timings[stage] += time.perf_counter() - start
