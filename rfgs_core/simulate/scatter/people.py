# SPDX-License-Identifier: Apache-2.0
"""The channel of people: facets lit straight, by way of one wall or through one, for every link."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.sites import measured_pairs, ports
from rfgs_core.simulate.geometry.room import Room
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.simulate.scatter.grid import array_reach, delay_grid, to_subcarriers
from rfgs_core.simulate.scatter.kernel import Arrays, Patches, spread_facets
from rfgs_core.simulate.scatter.sites import look_around, tabled_slabs
from rfgs_core.simulate.scatter.ways import Scope, Ways, bodies_of, find_ways, pictures_of
from rfgs_core.simulate.surface.posed import Facets


class Arrivals(NamedTuple):
    """What reaches the facets of one body from all sites."""

    span: slice
    """Where they are among all facets."""
    sent: tuple[Ways, ...]
    """From transmitters, port by port."""
    heard: tuple[Ways, ...]
    """From receivers, port by port, as if they sent."""


class PeopleChannel:
    """Channels of facets in one room, between the antennas of one radio."""

    def __init__(
        self,
        room: Room,
        around: Surroundings,
        layout: Layout,
        devices: list[DevicePose],
        radio: Radio,
        depth: int,
    ) -> None:
        """Looks around from every site.

        Args:
            room: What stands still.
            around: What the sites see of its faces.
            layout: Antenna elements.
            devices: Poses of the devices.
            radio: Gives subcarriers, pattern and polarisation.
            depth: Interactions of a path, the facet's included: 1, 2 or 3.
        """
        slab_s = (depth - 1) * room.slab_delay_s(radio.centre_hz)
        self._layout, self._grid = layout, delay_grid(radio, layout, slab_s)
        self._pairs = measured_pairs(layout)
        self._tx, self._rx = look_around(room, around, layout, devices, radio, depth)
        size_m = array_reach(layout.tx_xyz, layout.tx_site)
        size_m += array_reach(layout.rx_xyz, layout.rx_site)
        node_k = self._grid.node_k
        slabs = tabled_slabs(room, self._grid.node_hz)
        self._scope = Scope(room.faces, slabs, len(node_k), float(node_k[0]), size_m, depth)

    @property
    def node_hz(self) -> np.ndarray:
        """Frequencies at which materials are asked for [Hz], shape (node,)."""
        return self._grid.node_hz

    def arrivals(self, facets: Facets) -> list[Arrivals]:
        """What reaches each body from all sites, with everything that moves in place."""
        bodies = bodies_of(facets)
        tx_seen, rx_seen = (
            [pictures_of(bodies, site.around.place) for site in sites]
            for sites in (self._tx, self._rx)
        )
        to_rx = [[self._rx[b] for b in np.flatnonzero(row)] for row in self._pairs]
        to_tx = [[self._tx[a] for a in np.flatnonzero(row)] for row in self._pairs.T]
        found = []
        for body in bodies:
            sent = [
                find_ways(self._scope, self._tx, to_rx, port, body, tx_seen)
                for port in range(len(self._tx[0].antennas))
            ]
            heard = [
                find_ways(self._scope, self._rx, to_tx, port, body, rx_seen)
                for port in range(len(self._rx[0].antennas))
            ]
            found.append(Arrivals(body.span, tuple(sent), tuple(heard)))
        return found

    def channel(self, facets: Facets, arrivals: list[Arrivals], gamma: np.ndarray) -> np.ndarray:
        """What facets add to every measured link, complex64, shape (tx, rx, subcarrier).

        Args:
            facets: The facets, where they are now.
            arrivals: What reaches them, perhaps a moment before.
            gamma: Reflection coefficient of each material at `node_hz`, shape (material, node).
        """
        layout, grid = self._layout, self._grid
        shape = (len(layout.tx_xyz), len(layout.rx_xyz), len(grid.row))
        out = np.zeros(shape, dtype=np.complex64)
        gamma = np.ascontiguousarray(gamma, dtype=np.complex64)
        for i, j in ports(layout):
            for b in range(len(self._rx)):
                senders = np.flatnonzero(self._pairs[:, b])
                n_tx, n_rx = self._tx[0].elements[i].shape[1], self._rx[b].elements[j].shape[1]
                size = (len(senders), len(grid.node_k), 2, grid.cells, n_tx * n_rx)
                cells = np.zeros(size, dtype=np.float32)
                for body in arrivals:
                    self._spread(facets, gamma, body, (i, j), b, cells)
                for a, part in zip(senders, cells, strict=True):
                    links = to_subcarriers(grid, part)
                    tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == i))
                    rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == j))
                    out[np.ix_(tx, rx)] = links.T.reshape(n_tx, n_rx, -1)
        out[~layout.measured] = 0.0
        return out

    def _spread(
        self,
        facets: Facets,
        gamma: np.ndarray,
        body: Arrivals,
        port: tuple[int, int],
        b: int,
        cells: np.ndarray,
    ) -> None:
        """Adds one body's facets to the delays between all transmitting sites and a receiving."""
        grid, span = self._grid, body.span
        sent, heard = body.sent[port[0]], body.heard[port[1]]
        onto = np.cumsum(self._pairs[:, b]) - 1
        patches = Patches(
            facets.points[span],
            facets.normals[span],
            facets.areas[span],
            gamma,
            facets.material[span],
        )
        size_m = self._scope.size_m
        for way in np.flatnonzero(heard.site == b):
            walls = sent.walls + heard.walls[way]
            take = np.flatnonzero(self._pairs[sent.site, b] & (walls < self._scope.depth))
            spread_facets(
                patches,
                np.flatnonzero(heard.reaches[way]),
                heard.field[way],
                (sent.field, sent.reaches, take),
                Arrays(sent.centre, sent.offset, heard.centre[way], heard.offset[way], size_m),
                (grid.cell_m, grid.centre_k, grid.node_k),
                walls == 0,
                onto[sent.site],
                cells,
            )
