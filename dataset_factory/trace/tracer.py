# SPDX-License-Identifier: Apache-2.0
"""Channel state information of a scene bundle, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dataset_factory.scene.bundle import Bundle, BundleFrame
from dataset_factory.scene.motion import read_motion, read_velocity
from dataset_factory.trace.base import BaseTracer, Trace, mixed
from dataset_factory.trace.bounces.follow import follow
from dataset_factory.trace.bounces.solver import Bounces, with_facets
from dataset_factory.trace.bounces.walls import Walls
from dataset_factory.trace.environment import Environment
from dataset_factory.trace.people.sight import in_sight
from dataset_factory.trace.table.corners import CornerObjects
from dataset_factory.trace.table.maker import TableMaker
from rfgs_core.radio import Radio, frame_samples, layout, pose_span_s
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.path_table import PathTable
from rfgs_core.seeds import sub_seed
from rfgs_core.simulate.packets import sampled
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.paths.steering import steer
from rfgs_core.simulate.shadow.environment import environment_channel
from rfgs_core.simulate.shadow.kirchhoff import Shadow, transmission
from rfgs_core.simulate.shadow.outline import Outline
from rfgs_core.simulate.surface.direct import PosedPoints, direct_channel


class Tracer(BaseTracer):
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
        """Builds the scenes and traces the environment, see `BaseTracer`."""
        super().__init__(bundle, radio, devices, depth=depth, shadow=shadow, seed=seed)
        self._layout = layout(radio, devices)
        self._samples = frame_samples(radio, bundle.fps)
        bodies = self._bodies
        with self.timings.stage("environment"):
            environment = Environment(bundle, radio, self._layout, devices, self._rays)
            self._static_paths = environment.paths()
            self._static_corners = CornerObjects(bundle, environment.scene, bodies.vehicles)
            if len(bodies.vehicles):
                environment = Environment(
                    bundle, radio, self._layout, devices, self._rays, bodies.vehicles
                )
        self._environment = environment
        self._corners = CornerObjects(bundle, environment.scene, bodies.vehicles)
        self._tables = TableMaker(radio, self._layout, devices, shadow)
        self._bounces: Bounces | None = None
        # Where there is nothing to bounce off, a second interaction has nowhere to be.
        if bodies.scatter and depth > 1 and environment.reflects:
            rays, meshes = sub_seed(seed, "bounces"), environment.meshes
            self._bounces = Bounces(bodies.scene, meshes, self._layout, devices, depth, rays)
        self._walls = Walls(bundle, bodies.scene, bodies.vehicles, self._layout, devices, radio)

    def static(self) -> np.ndarray:
        """Channel without anything that moves, complex64, shape (tx, rx, subcarrier)."""
        channel = environment_channel(self._static_paths, self._radio, self._layout)
        return channel.astype(np.complex64)

    def static_paths(self) -> PathTable:
        """Paths behind `static`."""
        return self._tables.environment(self._static_paths, self._static_corners, [])

    def static_delays_s(self, tx: int, rx: int) -> np.ndarray:
        """Delays of the paths behind `static` between two devices, ascending [s], (path,)."""
        table = self.static_paths()
        return np.sort(table.delay_s[(table.tx_device == tx) & (table.rx_device == rx)])

    def paths(self, frame: BundleFrame, trace: Trace | None = None) -> PathTable:
        """Paths behind the channel at a frame's own time.

        Args:
            frame: What moves, in place.
            trace: Result of `trace` for this frame; None traces it.

        Raises:
            RfgsFormatError: The bundle was exported without velocities.
        """
        trace, bodies = trace or self.trace(frame), self._bodies
        velocity = read_velocity(self._bundle, frame.frame)
        vehicles = None
        if len(bodies.vehicles):
            vehicles = bodies.vehicles.posed(frame.vertices), bodies.vehicles.posed(velocity)
        parts = [self._tables.environment(trace.paths, self._corners, trace.outlines, vehicles)]
        if trace.points is not None:
            corners = CornerObjects(self._bundle, bodies.scene, bodies.vehicles)
            parts.append(
                self._tables.people(trace, bodies, corners, self._walls, velocity, vehicles)
            )
        return self._tables.joined(parts)

    def trace(self, frame: BundleFrame) -> Trace:
        """Everything about a frame that needs rays, for `samples` and `paths`."""
        return self.trace_at(frame.vertices)

    def samples(self, frame: BundleFrame, trace: Trace | None = None) -> np.ndarray:
        """Channels at every sample of a frame, complex64, shape (sample, tx, rx, subcarrier).

        The first is `frame`'s. For the others the scene is traced every `TRACE_STEP_S` at most;
        in between, points and facets are where the animation has them, with exact path lengths,
        while visibility, walls met and shadows fade from one trace to the next. Where there are
        vehicles, the environment is traced again for every sample.

        Args:
            frame: What moves, in place.
            trace: Result of `trace` for this frame; None traces it.
        """
        offset_s = self._samples.offset_s
        first = trace or self.trace(frame)
        channel = self._channel(first.points, (first,), (1.0,))
        out = np.zeros((len(offset_s), *channel.shape), dtype=np.complex64)
        out[0] = channel
        span_s = pose_span_s(self._radio)
        if span_s is None:
            return out
        motion = read_motion(self._bundle, frame.frame, span_s)
        for k, later in enumerate(sampled(self, first, offset_s, motion.at), start=1):
            out[k] = later
        return out

    def mixture(
        self, vertices: np.ndarray, traces: Sequence[Trace], shares: Sequence[float]
    ) -> np.ndarray:
        """Channel at a pose, visibility, walls and shadows as some traces have them, mixed.

        Args:
            vertices: Vertices of the bundle [m], shape (V, 3).
            traces: Traces before and after.
            shares: Weight of each.

        Returns:
            Complex128, shape (tx, rx, subcarrier).
        """
        environment = self._environment_at(vertices) if len(self._bodies.vehicles) else None
        return self._channel(self._bodies.points(vertices), traces, shares, environment)

    def frame(self, frame: BundleFrame) -> np.ndarray:
        """Channel at one frame; the result does not depend on frames traced before.

        Args:
            frame: What moves, in place.

        Returns:
            Complex64, shape (tx, rx, subcarrier), zero where a link is not measured.
        """
        trace = self.trace_at(frame.vertices)
        return self._channel(trace.points, (trace,), (1.0,)).astype(np.complex64)

    def trace_at(self, vertices: np.ndarray) -> Trace:
        """Everything that needs rays, with everything that moves in place.

        Args:
            vertices: Vertices of the bundle [m], shape (V, 3).
        """
        vertices = vertices.astype(np.float32)
        paths = self._paths_at(vertices)
        outlines = self._outlines(paths, vertices)
        environment = self._environment_of(paths, outlines)
        self._flush()
        points = self._bodies.points(vertices)
        if points is None:
            return Trace(environment, paths, outlines)
        self._bodies.move(vertices)
        with self.timings.stage("people_direct"):
            seen = in_sight(self._bodies.scene.mi_scene, points, self._layout)
        bounced = None
        around = self._environment.around
        if self._bounces is not None and around is not None:
            with self.timings.stage("people_bounces"):
                bounced = self._bounces.paths(points, around)
        return Trace(environment, paths, outlines, points, seen, bounced)

    def _environment_at(self, vertices: np.ndarray) -> np.ndarray:
        """Channel of everything but people's echoes, complex128, (tx, rx, subcarrier)."""
        vertices = vertices.astype(np.float32)
        paths = self._paths_at(vertices)
        return self._environment_of(paths, self._outlines(paths, vertices))

    def _outlines(self, paths: PathSet, vertices: np.ndarray) -> list[Outline]:
        """What shades paths that were just traced, people at places [m], shape (V, 3)."""
        with self.timings.stage("shadow"):
            return self._bodies.outlines(vertices, paths.vertices, self._environment.scene)

    def _environment_of(self, paths: PathSet, outlines: list[Outline]) -> np.ndarray:
        """Channel of the environment's paths past what casts shadows."""
        passed = None
        if outlines:
            with self.timings.stage("shadow"):
                passed = transmission(paths, self._layout, outlines, self._grid, self._shadow)
        with self.timings.stage("environment"):
            return environment_channel(paths, self._radio, self._layout, passed)

    def _channel(
        self,
        points: PosedPoints | None,
        traces: Sequence[Trace],
        shares: Sequence[float],
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
            with self.timings.stage("people_direct"):
                channel += direct_channel(
                    points,
                    mixed([(trace.seen, share) for trace, share in weighted]),
                    self._layout,
                    self._devices,
                    self._bodies.gamma(self._radio.freq_hz),
                    self._radio,
                )
            for trace, share in weighted:
                if share and trace.bounced is not None:
                    with self.timings.stage("people_bounces"):
                        channel += share * self._bounced(points, trace)
        channel[~self._layout.measured] = 0.0
        return channel

    def _paths_at(self, vertices: np.ndarray) -> PathSet:
        """Paths without people when the bundle's vertices are at places [m], shape (V, 3)."""
        vehicles = self._bodies.vehicles
        if not len(vehicles):
            return self._static_paths
        with self.timings.stage("environment"):
            return self._environment.paths(vehicles.posed(vertices))

    def _bounced(self, points: PosedPoints, trace: Trace) -> np.ndarray:
        """People's paths by way of walls, shape (tx, rx, subcarrier)."""
        assert trace.bounced is not None
        paths = trace.bounced
        if points is not trace.points:
            paths = follow(paths, points.positions)
        gamma = self._bodies.gamma(self._nodes)
        paths = with_facets(paths, points, gamma, self._nodes, self._radio.centre_hz)
        paths = self._walls.over_band(paths, self._nodes)
        return steer(paths, self._layout, self._radio.freq_hz, self._nodes)
