# SPDX-License-Identifier: Apache-2.0
"""Channels of a synthetic aperture: one device at many places while the scene stands still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dataset_factory.scene.bundle import Bundle, BundleFrame
from dataset_factory.trace.base import BaseTracer
from dataset_factory.trace.environment import Environment
from dataset_factory.trace.people.sight import in_sight
from rfgs_core.radio import Radio, devices_at, layout
from rfgs_core.radio.layout import DevicePose
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.environment import environment_channel
from rfgs_core.simulate.shadow.kirchhoff import Shadow, transmission
from rfgs_core.simulate.surface.direct import PosedPoints, direct_channel


class ApertureTracer(BaseTracer):
    """Traces a radio whose device moves; what it hears at each place is a sample of the frame.

    The environment is traced for all places at once, as for so many devices that hear only
    themselves; people are summed place by place, which keeps memory that of a single device.

    Example:
        tracer = ApertureTracer(bundle, preset("sar"), devices, depth=1)
        pulses = tracer.samples(bundle.frame(1))
    """

    def __init__(
        self,
        bundle: Bundle,
        radio: Radio,
        devices: list[DevicePose],
        *,
        depth: int = 1,
        shadow: Shadow = "kirchhoff",
        seed: int = 0,
    ) -> None:
        """Builds the scenes and traces the environment, see `BaseTracer`."""
        super().__init__(bundle, radio, devices, depth=depth, shadow=shadow, seed=seed)
        places = range(len(devices))
        self._layouts = [layout(radio, devices, place) for place in places]
        # The same antennas, each place a device of its own.
        standing = replace(radio, antennas_move=False)
        every = layout(standing, devices)
        with self.timings.stage("environment"):
            environment = Environment(bundle, standing, every, devices, self._rays)
            self._static_paths = self._by_place(environment.paths())
            vehicles = self._bodies.vehicles
            if len(vehicles):
                environment = Environment(bundle, standing, every, devices, self._rays, vehicles)
        self._environment = environment

    def static(self) -> np.ndarray:
        """Channels without anything that moves, complex64, shape (sample, tx, rx, subcarrier)."""
        pairs = zip(self._static_paths, self._layouts, strict=True)
        channels = [environment_channel(paths, self._radio, place) for paths, place in pairs]
        return np.stack(channels).astype(np.complex64)

    def samples(self, frame: BundleFrame) -> np.ndarray:
        """Channels at every place, complex64, shape (sample, tx, rx, subcarrier).

        Everything stands where `frame` has it; the result does not depend on frames traced
        before.
        """
        vertices = frame.vertices.astype(np.float32)
        self._flush()
        paths = self._paths_at(vertices)
        self._bodies.move(vertices)
        points = self._bodies.points(vertices)
        gamma = self._bodies.gamma(self._radio.freq_hz) if points is not None else {}
        channels = []
        for place, own in enumerate(paths):
            passed = None
            if points is not None:
                with self.timings.stage("shadow"):
                    scene = self._environment.scene
                    outlines = self._bodies.outlines(vertices, own.vertices, scene)
                    elements = self._layouts[place]
                    passed = transmission(own, elements, outlines, self._grid, self._shadow)
            with self.timings.stage("environment"):
                channel = environment_channel(own, self._radio, self._layouts[place], passed)
            if points is not None:
                with self.timings.stage("people_direct"):
                    channel += self._echo(place, points, gamma)
            channels.append(channel)
        return np.stack(channels).astype(np.complex64)

    def _echo(self, place: int, points: PosedPoints, gamma: dict[int, np.ndarray]) -> np.ndarray:
        """What scatters straight back to one place, complex128, shape (tx, rx, subcarrier)."""
        elements = self._layouts[place]
        seen = in_sight(self._bodies.scene.mi_scene, points, elements)
        here = devices_at(self._radio, self._devices, place)
        return direct_channel(points, seen, elements, here, gamma, self._radio)

    def _paths_at(self, vertices: np.ndarray) -> list[PathSet]:
        """Paths without people of each place, given the bundle's vertices [m], shape (V, 3)."""
        vehicles = self._bodies.vehicles
        if not len(vehicles):
            return self._static_paths
        with self.timings.stage("environment"):
            return self._by_place(self._environment.paths(vehicles.posed(vertices)))

    def _by_place(self, paths: PathSet) -> list[PathSet]:
        """The paths of each place, numbered as those of the only device there is then."""
        parts = [paths.select(paths.tx == place) for place in range(len(self._devices))]
        return [replace(part, tx=part.tx * 0, rx=part.rx * 0) for part in parts]
