# SPDX-License-Identifier: Apache-2.0
"""Waves along paths of known corners: polarisation, slabs at every angle, spreading.

At each slab the field is split into the part across the plane of incidence (TE) and the part in
it (TM); each is multiplied by the slab's own factor (Balanis, Advanced Engineering
Electromagnetics, 1989, section 5.3) and handed on in the new direction.
"""

from __future__ import annotations

import numpy as np

from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.antennas import field
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import REFRACTION, SPECULAR, directions
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.levels import amplitude_of
from rfgs_core.radio.reflection import slab
from rfgs_core.radio.sites import centres, owners, ports
from rfgs_core.simulate.geometry import SpecularPaths
from rfgs_core.simulate.geometry.room import Room
from rfgs_core.simulate.paths.path_set import PathSet


def with_fields(
    found: SpecularPaths,
    room: Room,
    layout: Layout,
    devices: list[DevicePose],
    radio: Radio,
    nodes_hz: np.ndarray,
) -> PathSet:
    """Gives paths between sites their amplitudes.

    Args:
        found: Paths between centres of sites, over the room's triangles.
        room: What they are mirrored by and pass through.
        layout: Antenna elements.
        devices: Poses of the devices.
        radio: Gives pattern, polarisation, isolation and the centre of the band.
        nodes_hz: Frequencies of the amplitudes [Hz], shape (node,).

    Returns:
        Paths with one amplitude c / (4π f_c L) · (fields and slabs) for each pair of ports and
        node: the aperture of the antennas, which goes with the wavelength, is that of the band's
        centre f_c.
    """
    tx_centres, rx_centres = centres(layout)
    tx_owner, rx_owner = owners(layout)
    vertices = np.concatenate(
        [tx_centres[found.tx][:, None], found.corners, rx_centres[found.rx][:, None]], axis=1
    )
    k = directions(vertices)
    count = (found.kinds != 0).sum(axis=1)
    last = k[np.arange(len(k)), count]
    length = np.linalg.norm(np.diff(vertices, axis=1), axis=2).sum(axis=1)
    amplitude = np.zeros((len(k), len(ports(layout)), len(nodes_hz)), dtype=np.complex128)
    slants = radio.slants_deg
    for pair, (i, j) in enumerate(ports(layout)):
        wave = of_sites(radio, slants[i], k[:, 0], tx_owner[found.tx], devices)
        wave = np.repeat(wave[:, None].astype(np.complex128), len(nodes_hz), axis=1)
        for corner in range(found.kinds.shape[1]):
            handed_on(wave, found, corner, k, room, nodes_hz)
        heard = of_sites(radio, slants[j], -last, rx_owner[found.rx], devices)
        amplitude[:, pair] = np.einsum("pnx,px->pn", wave, heard)
    amplitude *= (SPEED_OF_LIGHT / (4.0 * np.pi * radio.centre_hz) / length)[:, None, None]
    straight = (count == 0) & (tx_owner[found.tx] == rx_owner[found.rx])
    amplitude[straight] *= amplitude_of(-radio.isolation_db)
    nothing = np.where(found.kinds == 0, 0, found.triangles)
    return PathSet(
        found.tx, found.rx, amplitude, vertices, found.kinds, nothing, np.zeros_like(nothing)
    ).sorted()


def handed_on(
    wave: np.ndarray,
    found: SpecularPaths,
    corner: int,
    k: np.ndarray,
    room: Room,
    nodes_hz: np.ndarray,
) -> None:
    """Sends the waves of all paths past one of their corners, in place.

    Args:
        wave: Field of each path before the corner, complex128, shape (path, node, 3).
        found: The paths.
        corner: Which of their corners.
        k: Directions from corner to corner, shape (path, step, 3).
        room: What stands at the corner.
        nodes_hz: Frequencies of the fields [Hz], shape (node,).
    """
    kinds, triangles = found.kinds[:, corner], found.triangles[:, corner]
    material = np.where(kinds == 0, -1, room.material[triangles] if len(room.material) else -1)
    for index, row in enumerate(room.materials):
        here = np.flatnonzero(material == index)
        if not len(here):
            continue
        corners = room.triangles[triangles[here]]
        wave[here] = past_slab(
            wave[here],
            k[here, corner],
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
            kinds[here] == SPECULAR,
            (row.name, row.thickness_m, nodes_hz),
        )
    assert np.isin(kinds, (0, SPECULAR, REFRACTION)).all()


def past_slab(
    wave: np.ndarray,
    into: np.ndarray,
    normal: np.ndarray,
    mirrored: np.ndarray,
    material: tuple[str, float, np.ndarray],
) -> np.ndarray:
    """Fields behind slabs of one material, complex128, shape (path, node, 3).

    Args:
        wave: Fields in front of them, shape (path, node, 3).
        into: Unit directions of the waves, shape (path, 3).
        normal: Normals of the slabs, of any length and either side, shape (path, 3).
        mirrored: Whether each wave is mirrored, else it passes, bool, shape (path,).
        material: Name, thickness [m] and frequencies [Hz] of the slabs.
    """
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.sum(into * normal, axis=1)
    across = np.cross(into, normal)
    size = np.linalg.norm(across, axis=1, keepdims=True)
    # At normal incidence any direction in the wall is across.
    spare = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
    across = np.where(size > 1e-9, across, spare)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    out = into - np.where(mirrored, 2.0 * along, 0.0)[:, None] * normal
    factors = slab(*material, np.minimum(np.abs(along), 1.0))
    te = np.where(mirrored[:, None], factors.reflected_te, factors.passed_te)
    tm = np.where(mirrored[:, None], factors.reflected_tm, factors.passed_tm)
    te = te * np.einsum("pnx,px->pn", wave, across)
    tm = tm * np.einsum("pnx,px->pn", wave, np.cross(across, into))
    return te[:, :, None] * across[:, None] + tm[:, :, None] * np.cross(across, out)[:, None]


def of_sites(
    radio: Radio,
    slant_deg: float,
    directions: np.ndarray,
    owner: np.ndarray,
    devices: list[DevicePose],
) -> np.ndarray:
    """Fields that sites send along directions, or hear from them, shape (path, 3).

    Args:
        radio: Gives the pattern.
        slant_deg: Slant of the port [°].
        directions: Unit vectors away from the antennas, shape (path, 3).
        owner: Device of each, shape (path,).
        devices: Poses of the devices.
    """
    out = np.zeros((len(directions), 3))
    for device in np.unique(owner):
        here = owner == device
        axes = rotation(devices[device].quat_wxyz)
        out[here] = field(radio.pattern, slant_deg, directions[here], axes)
    return out
