# SPDX-License-Identifier: Apache-2.0
"""Path tables: the paths behind a frame's channel, between centres of sites."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from dataset_factory.trace.base import Trace
from dataset_factory.trace.bounces.solver import with_facets
from dataset_factory.trace.bounces.walls import Walls
from dataset_factory.trace.people.bodies import Bodies
from dataset_factory.trace.table.corners import CornerObjects, doppler_hz
from dataset_factory.trace.table.patches import (
    direct_paths,
    gathered,
    patch_size_m,
    patches,
    strong,
)
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import SCATTERING
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.path_table import PathTable, ends_rad
from rfgs_core.radio.sites import centres, owners
from rfgs_core.simulate.paths.path_set import PathSet, empty, merged
from rfgs_core.simulate.paths.steering import resampled
from rfgs_core.simulate.shadow.environment import (
    WIDE_BAND_NODES,
    node_frequencies,
    path_frequencies,
)
from rfgs_core.simulate.shadow.kirchhoff import Shadow, transmission
from rfgs_core.simulate.shadow.outline import Outline

#: Decimals of a delay [s] that are kept: femtoseconds, 0.3 µm.
DELAY_DIGITS = 15


def centre_layout(layout: Layout) -> Layout:
    """One element per site and port, at the site's centre."""
    first = [
        np.unique(np.stack([site, port], axis=1), axis=0, return_index=True)[1]
        for site, port in ((layout.tx_site, layout.tx_port), (layout.rx_site, layout.rx_port))
    ]
    tx, rx = first
    tx_centres, rx_centres = centres(layout)
    kept = {
        spec.name: getattr(layout, spec.name)[tx if spec.name.startswith("tx") else rx]
        for spec in fields(Layout)
        if spec.name != "measured"
    }
    kept["tx_xyz"], kept["rx_xyz"] = tx_centres[kept["tx_site"]], rx_centres[kept["rx_site"]]
    return Layout(**kept, measured=layout.measured[np.ix_(tx, rx)])


def table_frequencies(radio: Radio) -> np.ndarray:
    """Frequencies of a table's amplitudes [Hz].

    Nine over a band over which walls need fewer: shadows are then linear in between to 0.001 at
    160 MHz around 5.8 GHz, for silhouettes up to a Fresnel coordinate of 10.
    """
    count = max(len(node_frequencies(radio)), WIDE_BAND_NODES)
    return np.linspace(radio.freq_min_hz, radio.freq_max_hz, count)


class TableMaker:
    """Turns what was traced into tables."""

    def __init__(
        self, radio: Radio, layout: Layout, devices: list[DevicePose], shadow: Shadow
    ) -> None:
        self._radio, self._devices = radio, devices
        self._layout, self._centres = layout, centre_layout(layout)
        self._shadow: Shadow = shadow
        self._nodes = table_frequencies(radio)
        self._wavelength_m = SPEED_OF_LIGHT / radio.centre_hz

    def environment(
        self,
        paths: PathSet,
        corners: CornerObjects,
        outlines: list[Outline],
        vehicles: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> PathTable:
        """Rows of the environment, shadows included.

        Args:
            paths: Paths of `Environment`.
            corners: What they met.
            outlines: What casts shadows on them.
            vehicles: Where the vehicles' vertices are [m] and how fast they move [m/s].
        """
        if not len(paths):
            return self._table(paths, np.zeros((0, 0), np.int32), np.zeros(0))
        paths = resampled(paths, path_frequencies(paths, self._radio), self._nodes)
        amplitude = paths.amplitude * (self._radio.centre_hz / self._nodes)
        if outlines:
            passed = transmission(paths, self._centres, outlines, self._nodes, self._shadow)
            amplitude[passed.path] *= passed.factor[:, 0, 0, None, :]
        turns = np.zeros(len(paths))
        if vehicles is not None:
            velocity = corners.velocity(paths, *vehicles)
            turns = doppler_hz(paths, velocity, self._wavelength_m)
        return self._table(replace(paths, amplitude=amplitude), corners.ids(paths), turns)

    def people(
        self,
        trace: Trace,
        bodies: Bodies,
        corners: CornerObjects,
        walls: Walls,
        velocity: np.ndarray,
        vehicles: tuple[np.ndarray, np.ndarray] | None,
    ) -> PathTable:
        """Rows of everything that scatters from points.

        Args:
            trace: What rays have told, at a frame.
            bodies: What moves.
            corners: What the paths by way of walls met.
            walls: How that answers over the band.
            velocity: Velocity of the bundle's vertices [m/s], shape (V, 3).
            vehicles: As `environment` takes it.
        """
        posed, seen, surface = trace.points, trace.seen, bodies.surface
        assert posed is not None and seen is not None and surface is not None
        people, bounced, gamma = bodies.people, trace.bounced, bodies.gamma(self._nodes)
        direct = direct_paths(posed, seen, self._layout, self._devices, self._radio)
        parts = [direct] if bounced is None else [direct, bounced]
        paths = merged(parts)
        paths = with_facets(paths, posed, gamma, self._nodes, self._radio.centre_hz)
        paths = walls.over_band(paths, self._nodes)
        if not len(paths):
            return self._table(empty(0, len(self._nodes)), np.zeros((0, 0), np.int32), np.zeros(0))
        instance = people.instance[surface.triangle]
        segment = people.segment[surface.triangle]
        rest = surface.at(people.rest_vertices)[0]
        group = np.stack([instance, segment], axis=1)
        patch = patches(rest, group, patch_size_m(self._nodes))
        rows, row, share = gathered(paths, posed, patch, self._nodes)
        scatters = paths.kinds == SCATTERING
        moves = np.zeros((*paths.kinds.shape, 3))
        if vehicles is not None:
            moves = corners.velocity(paths, *vehicles)
        moves[scatters] = surface.carried(people.posed(velocity))[paths.primitives[scatters]]
        turns = share * doppler_hz(paths, moves, self._wavelength_m)
        objects = corners.ids(rows)
        at = rows.kinds == SCATTERING
        objects[at] = corners.of_instance[instance[rows.primitives[at]]]
        table = self._table(rows, objects, np.bincount(row, turns, len(rows)))
        return table.select(strong(rows))

    def joined(self, parts: list[PathTable]) -> PathTable:
        """Rows of several tables, sorted by pair and delay."""
        bounces = max(part.kind.shape[1] for part in parts)
        parts = [_widened(part, bounces) for part in parts]
        columns = {
            spec.name: np.concatenate([getattr(part, spec.name) for part in parts])
            for spec in fields(PathTable)
            if spec.name != "node_hz"
        }
        every = PathTable(**columns, node_hz=parts[0].node_hz)
        return every.select(np.lexsort((every.delay_s, every.rx_site, every.tx_site)))

    def _table(self, paths: PathSet, objects: np.ndarray, turns_hz: np.ndarray) -> PathTable:
        tx_owner, rx_owner = owners(self._layout)
        ports = len(self._radio.slants_deg) ** 2
        amplitude = paths.amplitude if len(paths) else np.zeros((0, ports, len(self._nodes)))
        return PathTable(
            tx_site=paths.tx.astype(np.int32),
            rx_site=paths.rx.astype(np.int32),
            tx_device=tx_owner[paths.tx].astype(np.int32),
            rx_device=rx_owner[paths.rx].astype(np.int32),
            amplitude=amplitude.astype(np.complex64),
            node_hz=self._nodes,
            # NumPy's last bits depend on where arrays lie in memory; those of files must not.
            delay_s=np.round(paths.length_m / SPEED_OF_LIGHT, DELAY_DIGITS),
            doppler_hz=turns_hz.astype(np.float32),
            **ends_rad(paths.vertices, paths.kinds),
            kind=paths.kinds.astype(np.uint8),
            object=objects,
            vertices=paths.vertices.astype(np.float32),
        )


def _widened(part: PathTable, bounces: int) -> PathTable:
    """The same rows with room for more bounces."""
    extra = bounces - part.kind.shape[1]
    room = ((0, 0), (0, extra))
    return replace(
        part,
        kind=np.pad(part.kind, room),
        object=np.pad(part.object, room),
        vertices=np.concatenate(
            [part.vertices, np.repeat(part.vertices[:, -1:], extra, axis=1)], axis=1
        ),
    )
