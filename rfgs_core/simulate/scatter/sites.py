# SPDX-License-Identifier: Apache-2.0
"""Sites of antennas that have looked around: what stands still, and what mirrors people."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.reflection import slab
from rfgs_core.radio.sites import centres, owners
from rfgs_core.simulate.geometry.room import Room
from rfgs_core.simulate.geometry.surroundings import Surroundings
from rfgs_core.simulate.scatter.antenna import CODES, Antenna
from rfgs_core.simulate.scatter.arrivals import Slabs
from rfgs_core.simulate.sight.mirrors import Mirror, mirror
from rfgs_core.simulate.sight.panorama import SIZE, Panorama, panorama

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


def look_around(
    room: Room,
    around: Surroundings,
    layout: Layout,
    devices: list[DevicePose],
    radio: Radio,
    depth: int,
) -> tuple[list[Site], list[Site]]:
    """The transmitting and the receiving sites of a radio.

    Args:
        room: What stands still.
        around: What the sites see of its faces.
        layout: Antenna elements.
        devices: Poses of the devices.
        radio: Gives pattern and polarisation.
        depth: Interactions of people's paths; at 1 nothing mirrors.
    """
    tx, rx = centres(layout)
    tx_owner, rx_owner = owners(layout)
    panoramas: dict[bytes, Panorama] = {}

    def site(
        centre: np.ndarray, device: DevicePose, elements: list[np.ndarray], hidden: np.ndarray
    ) -> Site:
        key = centre.tobytes()
        if key not in panoramas:
            panoramas[key] = panorama(room.faces, centre, SIZE)
        antennas = [
            _antenna(radio, slant_deg, device, xyz, centre)
            for xyz, slant_deg in zip(elements, radio.slants_deg, strict=True)
        ]
        mirrors = _mirrors(room, centre, hidden) if depth > 1 else ()
        columns = tuple(np.ascontiguousarray(xyz.T) for xyz in elements)
        return Site(columns, tuple(antennas), panoramas[key], mirrors)

    def of_ports(xyz: np.ndarray, here: np.ndarray, port: np.ndarray) -> list[np.ndarray]:
        return [xyz[here & (port == p)] for p in np.unique(port)]

    senders = [
        site(
            tx[s],
            devices[tx_owner[s]],
            of_ports(layout.tx_xyz, layout.tx_site == s, layout.tx_port),
            around.tx_hidden[s],
        )
        for s in range(len(tx))
    ]
    receivers = [
        site(
            rx[s],
            devices[rx_owner[s]],
            of_ports(layout.rx_xyz, layout.rx_site == s, layout.rx_port),
            around.rx_hidden[s],
        )
        for s in range(len(rx))
    ]
    return senders, receivers


def tabled_slabs(room: Room, node_hz: np.ndarray) -> Slabs:
    """Factors of a room's materials over angles.

    Args:
        room: The room.
        node_hz: Frequencies [Hz], shape (node,).
    """
    of_face = np.zeros(len(room.faces.normal), dtype=np.int64)
    known = room.faces.of_triangle >= 0
    of_face[room.faces.of_triangle[known]] = room.material[known]
    cosines = np.linspace(0.0, 1.0, _COSINES)
    shape = (len(room.materials), _COSINES, 2, len(node_hz))
    mirrored, passed = np.zeros(shape, np.complex64), np.zeros(shape, np.complex64)
    for index, row in enumerate(room.materials):
        factors = slab(row.name, row.thickness_m, node_hz, cosines)
        mirrored[index] = np.stack([factors.reflected_te, factors.reflected_tm], axis=1)
        passed[index] = np.stack([factors.passed_te, factors.passed_tm], axis=1)
    return Slabs(of_face, mirrored, passed)


def _antenna(
    radio: Radio, slant_deg: float, device: DevicePose, xyz: np.ndarray, centre: np.ndarray
) -> Antenna:
    """The antenna of one port."""
    slant = np.deg2rad(slant_deg)
    # Multiples of 45° exactly: an upright antenna has no trace of the other component.
    cosine, sine = (round(float(part), 15) for part in (np.cos(slant), np.sin(slant)))
    reach_m = float(np.linalg.norm(xyz - centre, axis=1).max())
    return Antenna(CODES[radio.pattern], (cosine, sine), rotation(device.quat_wxyz), reach_m)


def _mirrors(room: Room, centre: np.ndarray, hidden: np.ndarray) -> tuple[Mirror, ...]:
    """Faces large enough that a place sees."""
    faces = room.faces
    area = (faces.high - faces.low).prod(axis=1)
    lit = np.flatnonzero((hidden == 0) & (area > SMALLEST_MIRROR_M2))
    return tuple(mirror(faces, int(face), centre) for face in lit)
