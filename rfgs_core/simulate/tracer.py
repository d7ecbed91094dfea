# SPDX-License-Identifier: Apache-2.0
"""The fast tracer: H = H_environment · shadow + H_people, without rays where it can be helped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rfgs_core.radio import Radio, layout
from rfgs_core.radio.check import refuse_places
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.reflection import material_permittivity
from rfgs_core.radio.sites import centres, measured_pairs, owners
from rfgs_core.radio.tissue import normal_reflection
from rfgs_core.seeds import sub_seed
from rfgs_core.simulate.geometry import Sight, Surroundings, specular_paths
from rfgs_core.simulate.geometry.bvh import Bvh
from rfgs_core.simulate.geometry.room import Room
from rfgs_core.simulate.paths.fields import with_fields
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.scatter.people import Arrivals, PeopleChannel
from rfgs_core.simulate.shadow.environment import (
    environment_channel,
    node_frequencies,
    shadow_channel,
)
from rfgs_core.simulate.shadow.frequencies import fine_grid
from rfgs_core.simulate.shadow.in_view import segments_in_view
from rfgs_core.simulate.shadow.kirchhoff import Shadow, transmission
from rfgs_core.simulate.shadow.near import near_segments
from rfgs_core.simulate.shadow.outline import Outline, coarse_mesh
from rfgs_core.simulate.sight.free import free_segments
from rfgs_core.simulate.surface.bodies import BodySurface
from rfgs_core.simulate.surface.movers import Movers
from rfgs_core.simulate.surface.posed import Facets
from rfgs_core.timings import Timings


@dataclass(frozen=True)
class Instant:
    """What was found at one instant."""

    environment: np.ndarray
    """Channel of everything but people's echoes, complex128, shape (tx, rx, subcarrier)."""
    arrivals: list[Arrivals]
    """What reaches each person's facets."""
    facets: Facets | None
    """The facets, None where nobody is."""
    vertices: np.ndarray
    """Everything that moves [m], shape (V, 3)."""


class FastTracer:
    """Channels of one radio in one room in which meshes move.

    The walls' paths are found by images and their fields by slabs of any angle; people are
    facets, lit straight, by way of one mirror or through one slab; their shadow is Kirchhoff's.
    Vehicles are metal: the environment's paths are found anew in every frame, but people are not
    seen by way of them.

    Example:
        tracer = FastTracer(box_room(low, high, SlabMaterial("concrete", 0.2)), people, vehicles,
                            radio, devices)
        csi = tracer.frame(vertices)
    """

    def __init__(
        self,
        room: Room,
        people: Movers,
        vehicles: Movers,
        radio: Radio,
        devices: list[DevicePose],
        *,
        depth: int = 2,
        shadow: Shadow = "kirchhoff",
        seed: int = 0,
    ) -> None:
        """Finds the paths of the empty room and looks around from every site.

        Args:
            room: What stands still; movers' materials are indices into its own.
            people: What scatters from facets.
            vehicles: Rigid metal.
            radio: Radio to simulate; its antennas stand still.
            devices: Poses of its devices.
            depth: Interactions of people's paths: 1 direct, 2 with one wall, 3 with one at both
                ends.
            shadow: "kirchhoff", or "hard" for all or nothing.
            seed: Root seed of the facets.

        Raises:
            RfgsError: One device sends from where another hears, or nobody hears anybody.
        """
        refuse_places(radio, devices)
        self._room, self._radio, self._devices = room, radio, devices
        self._people, self._vehicles = people, vehicles
        self._shadow: Shadow = shadow
        self._layout = layout(radio, devices)
        self._nodes = node_frequencies(radio, room.slab_delay_s(radio.centre_hz))
        self._grid = fine_grid(self._nodes)
        self._sight = Sight(*centres(self._layout))
        self.timings = Timings("environment", "shadow", "people")
        with self.timings.stage("environment"):
            around = self._look(room)
            self._static_paths = self._paths(room, around)
        # Every frame's channel holds what people do not change.
        self._unshaded = environment_channel(self._static_paths, radio, self._layout)
        self._outlines = [
            coarse_mesh(people.rest_vertices, people.faces[people.instance == instance])
            for instance in np.unique(people.instance)
        ]
        self._surface: BodySurface | None = None
        if len(people):
            with self.timings.stage("people"):
                self._surface = BodySurface(people, vehicles, radio, sub_seed(seed, "points"))
                self._echoes = PeopleChannel(room, around, self._layout, devices, radio, depth)
                self._gamma = self._reflections()

    def static(self) -> np.ndarray:
        """Channel without anything that moves, complex64, shape (tx, rx, subcarrier)."""
        return self._unshaded.astype(np.complex64)

    def static_delays_s(self, tx: int, rx: int) -> np.ndarray:
        """Delays of the paths behind `static` between two devices, ascending [s], (path,)."""
        tx_owner, rx_owner = owners(self._layout)
        paths = self._static_paths
        here = (tx_owner[paths.tx] == tx) & (rx_owner[paths.rx] == rx)
        return np.sort(paths.length_m[here]) / SPEED_OF_LIGHT

    def frame_at(self, vertices: np.ndarray) -> np.ndarray:
        """Channel at one pose; it does not depend on poses before.

        Args:
            vertices: Everything that moves [m], shape (V, 3).

        Returns:
            Complex64, shape (tx, rx, subcarrier), zero where a link is not measured.
        """
        return self.mixture(vertices, (self.trace_at(vertices),), (1.0,)).astype(np.complex64)

    def trace_at(self, vertices: np.ndarray) -> Instant:
        """What stands in whose way, with everything that moves at vertices [m], shape (V, 3)."""
        environment = self._environment_at(vertices.astype(np.float32))
        facets, arrivals = None, []
        if self._surface is not None:
            with self.timings.stage("people"):
                facets = self._surface.facets(vertices.astype(np.float32))
                arrivals = self._echoes.arrivals(facets)
        return Instant(environment, arrivals, facets, vertices)

    def mixture(
        self, vertices: np.ndarray, traces: Sequence[Instant], shares: Sequence[float]
    ) -> np.ndarray:
        """Channel at a pose, what reaches the facets as traces have it, each with its share.

        Args:
            vertices: Everything that moves [m], shape (V, 3).
            traces: Traces before and after.
            shares: Weight of each.

        Returns:
            Complex128, shape (tx, rx, subcarrier).
        """
        if len(self._vehicles) and len(traces) > 1:
            channel = self._environment_at(vertices.astype(np.float32))
        else:
            channel = shares[0] * traces[0].environment
            for trace, share in zip(traces[1:], shares[1:], strict=True):
                channel += share * trace.environment
        if self._surface is not None:
            with self.timings.stage("people"):
                facets = traces[0].facets if traces[0].vertices is vertices else None
                facets = facets or self._surface.facets(vertices)
                for trace, share in zip(traces, shares, strict=True):
                    if share and trace.arrivals:
                        echo = self._echoes.channel(facets, trace.arrivals, self._gamma)
                        channel += echo if share == 1.0 else share * echo
        channel[~self._layout.measured] = 0.0
        return channel

    def _environment_at(self, vertices: np.ndarray) -> np.ndarray:
        """Channel of everything but people's echoes, complex128, (tx, rx, subcarrier)."""
        paths, room, channel = self._static_paths, self._room, self._unshaded
        if len(self._vehicles):
            with self.timings.stage("environment"):
                room = self._with_vehicles(vertices)
                paths = self._paths(room, self._look(room))
                channel = environment_channel(paths, self._radio, self._layout)
        outlines = self._shades(paths, room.faces.bvh, vertices)
        if not outlines:
            return channel
        with self.timings.stage("shadow"):
            passed = transmission(paths, self._layout, outlines, self._grid, self._shadow)
            return channel + shadow_channel(paths, self._radio, self._layout, passed)

    def _shades(self, paths: PathSet, standing: Bvh, vertices: np.ndarray) -> list[Outline]:
        """What casts the shadow of each person."""
        posed, outlines = self._people.posed(vertices), []
        with self.timings.stage("shadow"):
            for kept, mesh in self._outlines:
                body = posed[kept]
                near = near_segments(paths, body, float(self._grid.max()))
                free = partial(free_segments, standing)
                seen = segments_in_view(free, paths.vertices, body, mesh.faces, near)
                outlines.append(Outline(body, mesh, seen))
        return outlines

    def _look(self, room: Room) -> Surroundings:
        """What the sites see of a room's faces."""
        moves = np.arange(len(room.triangles)) >= len(self._room.triangles)
        return self._sight.of(room.faces, moves)

    def _paths(self, room: Room, around: Surroundings) -> PathSet:
        """Paths between the sites, with their fields."""
        found = specular_paths(around, measured_pairs(self._layout))
        return with_fields(found, room, self._layout, self._devices, self._radio, self._nodes)

    def _with_vehicles(self, vertices: np.ndarray) -> Room:
        """The room with vehicles in it."""
        vehicles, room = self._vehicles, self._room
        driven = vehicles.posed(vertices).astype(np.float64)[vehicles.faces]
        first = int(room.mesh.max(initial=-1)) + 1
        return Room(
            np.concatenate([room.triangles, driven]),
            np.concatenate([room.mesh, first + vehicles.material]),
            np.concatenate([room.material, vehicles.material]),
            room.materials,
            room.source,
        )

    def _reflections(self) -> np.ndarray:
        """Reflection coefficient of each material at the nodes, shape (material, node)."""
        node_hz = self._echoes.node_hz
        gamma = np.zeros((len(self._room.materials), len(node_hz)), dtype=np.complex128)
        for index in np.unique(self._people.material):
            name = self._room.materials[index].name
            gamma[index] = normal_reflection(material_permittivity(name, node_hz))
        return gamma
