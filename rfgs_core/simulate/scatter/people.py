# SPDX-License-Identifier: Apache-2.0
"""The channel of people: facets lit straight, by way of one wall or through one, for every link."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.reflection import slab
from rfgs_core.radio.sites import centres, owners, ports, site_pairs
from rfgs_core.simulate.geometry import Faces
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.simulate.room import Room
from rfgs_core.simulate.scatter.antenna import CODES, Antenna
from rfgs_core.simulate.scatter.arrivals import Facets, Pictures, Slabs, by_mirror, straight
from rfgs_core.simulate.scatter.grid import BETA, delay_grid, to_subcarriers
from rfgs_core.simulate.scatter.kernel import spread_facets
from rfgs_core.simulate.sight.bodies import SIZE, picture
from rfgs_core.simulate.sight.mirrors import Mirror, meets_ball, mirror
from rfgs_core.simulate.sight.panorama import ROWS, Panorama, panorama

#: Faces smaller than this do not mirror people [m²].
SMALLEST_MIRROR_M2 = 0.02
#: Pixels of what moves as seen by way of a mirror, along a side.
MIRRORED_SIZE = 96
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


class Way(NamedTuple):
    """What reaches the facets from a port of a site by one way."""

    walls: int
    """Walls it meets."""
    elements: np.ndarray
    """Elements, or their mirror images [m], shape (3, element)."""
    centre: np.ndarray
    """Their centre [m], shape (3,)."""
    field: np.ndarray
    """θ and φ of the field on each facet, complex64, shape (facet, 2, node)."""


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

    def channel(self, facets: Facets, gamma: np.ndarray) -> np.ndarray:
        """What facets add to every measured link, complex64, shape (tx, rx, subcarrier).

        Args:
            facets: The facets, in place.
            gamma: Reflection coefficient of each material at `node_hz`, shape (material, node).
        """
        layout, grid = self._layout, self._grid
        shape = (len(layout.tx_xyz), len(layout.rx_xyz), len(grid.row))
        out = np.zeros(shape, dtype=np.complex64)
        gamma = np.ascontiguousarray(gamma, dtype=np.complex64)
        balls = _balls(facets)
        sent = [self._ways(site, facets, balls) for site in self._tx]
        heard = [self._ways(site, facets, balls) for site in self._rx]
        for a, b in site_pairs(layout):
            for i, j in ports(layout):
                tx = np.flatnonzero((layout.tx_site == a) & (layout.tx_port == i))
                rx = np.flatnonzero((layout.rx_site == b) & (layout.rx_port == j))
                links = self._between(facets, gamma, sent[a][i], heard[b][j], (len(tx), len(rx)))
                out[np.ix_(tx, rx)] = links
        out[~layout.measured] = 0.0
        return out

    def _between(
        self,
        facets: Facets,
        gamma: np.ndarray,
        sent: list[Way],
        heard: list[Way],
        size: tuple[int, int],
    ) -> np.ndarray:
        """Channel between two ports, complex64, shape (tx, rx, subcarrier)."""
        grid = self._grid
        cells = np.zeros((len(grid.node_k), 2, grid.cells, size[0] * size[1]), dtype=np.float32)
        for a in sent:
            for b in heard:
                if a.walls + b.walls < self._depth:
                    spread_facets(
                        facets.points,
                        facets.normals,
                        facets.areas,
                        (a.field, b.field),
                        gamma,
                        facets.material,
                        (a.elements, b.elements, a.centre, b.centre),
                        (grid.cell_m, grid.centre_k, grid.node_k),
                        BETA,
                        cells,
                    )
        channel = to_subcarriers(grid, cells[:, 0] + 1j * cells[:, 1])
        return channel.T.reshape(*size, -1)

    def _ways(self, site: Site, facets: Facets, balls: list) -> list[list[Way]]:
        """What reaches the facets from each port of a site."""
        pictures = _pictures(facets, site.around.place, balls)
        faces, shape = self._room.faces, (len(facets.points), 2, len(self._grid.node_k))
        every = []
        for elements, antenna in zip(site.elements, site.antennas, strict=True):
            clear = np.zeros(shape, dtype=np.complex64)
            through = np.zeros(shape if self._depth > 1 else (0, 2, 1), dtype=np.complex64)
            n_clear, n_through = straight(
                facets, pictures, site.around, faces, antenna, self._slabs, clear, through
            )
            ways = [Way(0, elements, site.around.place, clear)] if n_clear else []
            if n_through:
                ways.append(Way(1, elements, site.around.place, through))
            if self._depth > 1:
                ways += self._mirrored(site, elements, antenna, facets, pictures, balls)
            every.append(ways)
        return every

    def _mirrored(
        self,
        site: Site,
        elements: np.ndarray,
        antenna: Antenna,
        facets: Facets,
        pictures: Pictures,
        balls: list,
    ) -> list[Way]:
        """What reaches the facets by way of each mirror."""
        faces, ways = self._room.faces, []
        shape = (len(facets.points), 2, len(self._grid.node_k))
        for view in site.mirrors:
            field, count = None, 0
            for first, end, centre, radius in balls:
                if not meets_ball(faces, view.face, view.image, centre, radius):
                    continue
                if field is None:
                    field = np.zeros(shape, dtype=np.complex64)
                drawn = picture(facets.triangles, view.image, centre, radius, MIRRORED_SIZE)
                count += by_mirror(
                    facets,
                    (first, end),
                    drawn,
                    pictures,
                    site.around,
                    faces,
                    view,
                    antenna,
                    self._slabs,
                    field,
                )
            if field is not None and count:
                ways.append(Way(1, _images(faces, view.face, elements), view.image, field))
        return ways

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
            panorama(faces.bvh, centre, ROWS),
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
    drawn = [picture(facets.triangles, place, ball[2], ball[3], SIZE) for ball in balls]
    return Pictures(
        np.stack([row.axes for row in drawn]),
        np.array([row.per_pixel for row in drawn]),
        np.stack([row.nearest for row in drawn]),
        np.stack([row.depth for row in drawn]),
    )
