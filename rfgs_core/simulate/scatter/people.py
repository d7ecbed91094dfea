# SPDX-License-Identifier: Apache-2.0
"""The channel of people: facets lit straight, by way of one wall or through one, for every link."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.reflection import slab
from rfgs_core.radio.sites import centres, measured_pairs, owners, ports
from rfgs_core.simulate.geometry import Faces
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.simulate.room import Room
from rfgs_core.simulate.scatter.antenna import CODES, Antenna
from rfgs_core.simulate.scatter.arrivals import (
    Pictures,
    Slabs,
    by_mirror,
    free_facets,
    straight,
    wanted_facets,
)
from rfgs_core.simulate.scatter.grid import array_reach, delay_grid, to_subcarriers
from rfgs_core.simulate.scatter.kernel import spread_facets
from rfgs_core.simulate.sight.bodies import SIZE, picture
from rfgs_core.simulate.sight.mirrors import Mirror, meeting_ball, mirror
from rfgs_core.simulate.sight.panorama import SIZE as AROUND
from rfgs_core.simulate.sight.panorama import Panorama, panorama
from rfgs_core.simulate.surface.posed import Facets

#: Faces smaller than this do not mirror people [m²].
SMALLEST_MIRROR_M2 = 0.1
#: Angles at which slabs are tabled.
_COSINES = 513


class Site(NamedTuple):
    """One place that sends or hears."""

    elements: tuple[np.ndarray, ...]
    """Elements of each port [m], each of shape (3, element)."""
    antennas: tuple[Antenna, ...]
    """Antenna of each port."""
    around: Panorama
    """What stands around it."""
    mirrors: tuple[Mirror, ...]
    """Faces that it sees people by way of."""


class Ways(NamedTuple):
    """What reaches the facets from one port of some sites, way by way."""

    site: np.ndarray
    """Site of each way, int64, shape (way,)."""
    walls: np.ndarray
    """Walls that it meets, int64, shape (way,)."""
    centre: np.ndarray
    """Centre of the array or of its mirror image [m], shape (way, 3)."""
    offset: np.ndarray
    """Elements from there, and their squared distances [m, m²], float32, (way, 4, element)."""
    field: np.ndarray
    """θ and φ of the field, 0 where it does not reach, complex64, shape (way, facet, 2, node)."""


class Arrivals(NamedTuple):
    """What reaches the facets from all sites."""

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
        self._room, self._layout, self._depth = room, layout, depth
        self._grid = delay_grid(radio, layout)
        self._pairs = measured_pairs(layout)
        self._size_m = array_reach(layout.tx_xyz, layout.tx_site)
        self._size_m += array_reach(layout.rx_xyz, layout.rx_site)
        self._slabs = self._tabled()
        tx, rx = centres(layout)
        tx_owner, rx_owner = owners(layout)
        self._tx, self._rx = (
            [
                self._site(
                    radio,
                    devices[owner[s]],
                    middle[s],
                    [xyz[(site == s) & (port == p)] for p in np.unique(port)],
                    hidden[s],
                )
                for s in range(len(middle))
            ]
            for middle, owner, xyz, site, port, hidden in (
                (tx, tx_owner, layout.tx_xyz, layout.tx_site, layout.tx_port, around.tx_hidden),
                (rx, rx_owner, layout.rx_xyz, layout.rx_site, layout.rx_port, around.rx_hidden),
            )
        )

    @property
    def node_hz(self) -> np.ndarray:
        """Frequencies at which materials are asked for [Hz], shape (node,)."""
        return self._grid.node_hz

    def arrivals(self, facets: Facets) -> Arrivals:
        """What reaches facets from all sites, with everything that moves in place."""
        balls = _balls(facets)
        tx_seen, rx_seen = (
            [_pictures(facets, site.around.place, balls) for site in sites]
            for sites in (self._tx, self._rx)
        )
        layout = self._layout
        return Arrivals(
            tuple(
                self._ways(self._tx, self._rx, port, facets, tx_seen, balls)
                for port in range(len(np.unique(layout.tx_port)))
            ),
            tuple(
                self._ways(self._rx, self._tx, port, facets, rx_seen, balls)
                for port in range(len(np.unique(layout.rx_port)))
            ),
        )

    def channel(self, facets: Facets, arrivals: Arrivals, gamma: np.ndarray) -> np.ndarray:
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
            ways = arrivals.sent[i], arrivals.heard[j]
            for b in np.unique(ways[1].site):
                self._add(facets, gamma, ways, int(b), (i, j), out)
        out[~layout.measured] = 0.0
        return out

    def _add(
        self,
        facets: Facets,
        gamma: np.ndarray,
        ways: tuple[Ways, Ways],
        b: int,
        port: tuple[int, int],
        out: np.ndarray,
    ) -> None:
        """Adds the channels of all transmitting sites to one receiving site."""
        layout, grid, (sent, heard) = self._layout, self._grid, ways
        senders = np.flatnonzero(self._pairs[:, b])
        onto = np.zeros(len(self._tx), dtype=np.int64)
        onto[senders] = np.arange(len(senders))
        size = sent.offset.shape[2], heard.offset.shape[2]
        shape = (len(senders), len(grid.node_k), 2, grid.cells, size[0] * size[1])
        cells = np.zeros(shape, dtype=np.float32)
        for way in np.flatnonzero(heard.site == b):
            fits = sent.walls + heard.walls[way] < self._depth
            take = np.flatnonzero(self._pairs[sent.site, b] & fits)
            spread_facets(
                facets.points,
                facets.normals,
                facets.areas,
                gamma,
                facets.material,
                np.flatnonzero(np.abs(heard.field[way, :, :, 0]).any(axis=1)),
                heard.field[way],
                (sent.field, take),
                (sent.centre, sent.offset, heard.centre[way], heard.offset[way]),
                (grid.cell_m, grid.centre_k, grid.node_k, self._size_m),
                (sent.walls + heard.walls[way]) == 0,
                onto[sent.site],
                cells,
            )
        for a, part in zip(senders, cells, strict=True):
            links = to_subcarriers(grid, part[:, 0] + 1j * part[:, 1]).T.reshape(*size, -1)
            tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == port[0]))
            rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == port[1]))
            out[np.ix_(tx, rx)] = links

    def _ways(
        self,
        sites: list[Site],
        others: list[Site],
        port: int,
        facets: Facets,
        pictures: list[Pictures],
        balls: list,
    ) -> Ways:
        """What reaches the facets from a port of sites."""
        faces = self._room.faces
        most = sum(2 + len(site.mirrors) for site in sites)
        shape = (most, len(facets.points), 2, len(self._grid.node_k))
        field = np.zeros(shape, dtype=np.complex64)
        rows: list[tuple[int, int, np.ndarray, np.ndarray]] = []
        for s, (site, seen) in enumerate(zip(sites, pictures, strict=True)):
            pairs = self._pairs[s] if sites is self._tx else self._pairs[:, s]
            partners = [others[i] for i in np.flatnonzero(pairs)]
            ends = np.array([other.around.place for other in partners]).reshape(-1, 3)
            images = [view.image for other in partners for view in other.mirrors]
            every = np.concatenate([ends, np.array(images).reshape(-1, 3)])
            elements, antenna = site.elements[port], site.antennas[port]
            clear, through = field[len(rows)], field[len(rows) + 1]
            wanted = self._wanted(facets, balls, site.around.place, every)
            count = straight(
                facets,
                seen,
                site.around,
                faces,
                antenna,
                self._slabs,
                wanted,
                clear,
                through if self._depth > 1 else through[:0],
            )
            rows.append((s, 0, site.around.place, elements))
            if count[1]:
                rows.append((s, 1, site.around.place, elements))
            for view, some in _views(faces, site, balls):
                onto = field[len(rows)]
                if self._by_mirror(site, view, antenna, facets, seen, some, ends, onto):
                    rows.append((s, 1, view.image, _images(faces, view.face, elements)))
        offsets = [_offsets(xyz, centre) for _, _, centre, xyz in rows]
        return Ways(
            np.array([row[0] for row in rows]),
            np.array([row[1] for row in rows]),
            np.stack([row[2] for row in rows]),
            np.stack(offsets),
            field[: len(rows)],
        )

    def _wanted(
        self, facets: Facets, balls: list, place: np.ndarray, partners: np.ndarray
    ) -> np.ndarray:
        """Facets of all bodies that a place and any partner may see together."""
        lowest_k, size_m = float(self._grid.node_k[0]), self._size_m
        parts = [
            wanted_facets(facets, ball[:2], place, partners, lowest_k, size_m) for ball in balls
        ]
        return np.concatenate(parts)

    def _by_mirror(
        self,
        site: Site,
        view: Mirror,
        antenna: Antenna,
        facets: Facets,
        seen: Pictures,
        balls: list,
        partners: np.ndarray,
        field: np.ndarray,
    ) -> int:
        """Fills in what reaches the facets by way of a mirror; returns how many it reaches."""
        faces, count = self._room.faces, 0
        for ball in balls:
            wanted = self._wanted(facets, [ball], view.image, partners)
            if not len(wanted):
                continue
            met = free_facets(facets, wanted, site.around, faces, view)
            if not len(met[0]):
                continue
            count += by_mirror(
                facets, met, seen, site.around, faces, view, antenna, self._slabs, field
            )
        return count

    def _site(
        self,
        radio: Radio,
        device: DevicePose,
        centre: np.ndarray,
        elements: list[np.ndarray],
        hidden: np.ndarray,
    ) -> Site:
        """One site, having looked around."""
        faces = self._room.faces
        antennas = []
        for xyz, slant_deg in zip(elements, radio.slants_deg, strict=True):
            slant = np.deg2rad(slant_deg)
            # Multiples of 45° exactly: an upright antenna has no trace of the other component.
            cosine, sine = (round(float(part), 15) for part in (np.cos(slant), np.sin(slant)))
            reach_m = float(np.linalg.norm(xyz - centre, axis=1).max())
            axes = rotation(device.quat_wxyz)
            antennas.append(Antenna(CODES[radio.pattern], (cosine, sine), axes, reach_m))
        mirrors: list[Mirror] = []
        if self._depth > 1:
            area = (faces.high - faces.low).prod(axis=1)
            lit = np.flatnonzero((hidden == 0) & (area > SMALLEST_MIRROR_M2))
            mirrors = [mirror(faces, int(face), centre) for face in lit]
        return Site(
            tuple(np.ascontiguousarray(xyz.T) for xyz in elements),
            tuple(antennas),
            panorama(faces, centre, AROUND),
            tuple(mirrors),
        )

    def _tabled(self) -> Slabs:
        """The factors of all materials over angles, at the nodes."""
        room, nodes = self._room, self._grid.node_hz
        of_face = np.zeros(len(room.faces.normal), dtype=np.int64)
        known = room.faces.of_triangle >= 0
        of_face[room.faces.of_triangle[known]] = room.material[known]
        cosines = np.linspace(0.0, 1.0, _COSINES)
        shape = (len(room.materials), _COSINES, 2, len(nodes))
        mirrored, passed = np.zeros(shape, np.complex64), np.zeros(shape, np.complex64)
        for index, row in enumerate(room.materials):
            factors = slab(row.name, row.thickness_m, nodes, cosines)
            mirrored[index] = np.stack([factors.reflected_te, factors.reflected_tm], axis=1)
            passed[index] = np.stack([factors.passed_te, factors.passed_tm], axis=1)
        return Slabs(of_face, mirrored, passed)


def _images(faces: Faces, face: int, elements: np.ndarray) -> np.ndarray:
    """Mirror images of elements, shape (3, element)."""
    normal, offset = faces.normal[face], faces.offset[face]
    return elements - 2.0 * normal[:, None] * (normal @ elements - offset)


def _views(faces: Faces, site: Site, balls: list) -> list[tuple[Mirror, list]]:
    """Mirrors by way of which a site may see any of the bodies, and which of these."""
    face = np.array([view.face for view in site.mirrors], dtype=np.int64)
    image = np.array([view.image for view in site.mirrors]).reshape(-1, 3)
    met: dict[int, list] = {}
    for ball in balls:
        for index in meeting_ball(faces, face, image, *ball[2:]):
            met.setdefault(int(index), []).append(ball)
    return [(site.mirrors[index], met[index]) for index in sorted(met)]


def _offsets(elements: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Elements from their centre and squared distances from it, float32, shape (4, element)."""
    offset = elements - centre[:, None]
    return np.concatenate([offset, (offset**2).sum(axis=0, keepdims=True)]).astype(np.float32)


def _balls(facets: Facets) -> list[tuple[int, int, np.ndarray, float]]:
    """First facet, end, centre and radius [m] of a ball around each body."""
    balls = []
    for body in np.unique(facets.body):
        first, end = np.searchsorted(facets.body, [body, body + 1])
        points = facets.lifted[first:end]
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        radius = float(np.linalg.norm(points - centre, axis=1).max()) + 1e-3
        balls.append((int(first), int(end), centre, radius))
    return balls


def _pictures(facets: Facets, place: np.ndarray, balls: list) -> Pictures:
    """What moves as seen from a site, towards each body."""
    drawn = [
        picture(facets.vertices, facets.corners, place, ball[2], ball[3], SIZE) for ball in balls
    ]
    return Pictures(
        np.stack([row.axes for row in drawn]),
        np.array([row.per_pixel for row in drawn]),
        np.stack([row.nearest for row in drawn]),
        np.stack([row.depth for row in drawn]),
    )
