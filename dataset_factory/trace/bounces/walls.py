# SPDX-License-Identifier: Apache-2.0
"""How walls answer over the band, on paths by way of a person that Sionna has traced at its centre.

Sionna's amplitude holds at the carrier. A slab turns what passes it by its own delay: over 160 MHz
two passes of 20 cm of concrete turn an echo by half a turn. So each path is sent past its walls
once more at every frequency, as the fast tracer does it, and takes from that the ratio to the
carrier alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import sionna.rt as rt

from dataset_factory.scene.bundle import Bundle
from dataset_factory.trace.rays.scene import static_name, vehicle_meshes
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.images import SCATTERING, SPECULAR, directions
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.sites import owners, ports
from rfgs_core.simulate.paths.fields import of_sites, past_slab
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.surface.movers import Movers

#: Paths at a time, for memory's sake.
_BLOCK = 8192
#: Paths whose polarisation is crossed to less than this at the carrier stay as they are.
_CROSSED = 1e-6


class Walls:
    """The walls of a scene, by the numbers that Sionna has given them."""

    def __init__(
        self,
        bundle: Bundle,
        scene: rt.Scene,
        vehicles: Movers,
        layout: Layout,
        devices: list[DevicePose],
        radio: Radio,
    ) -> None:
        """Reads the numbers.

        Args:
            bundle: Gives meshes and materials.
            scene: From `environment_scene` of this bundle.
            vehicles: Those of the bundle.
            layout: Antenna elements.
            devices: Poses of the devices.
            radio: Gives pattern, polarisation and the carrier.
        """
        self._layout, self._devices, self._radio = layout, devices, radio
        self._materials = [
            (row["radio_material"], float(row["thickness_m"])) for row in bundle.materials
        ]
        number = {name: int(item.object_id) for name, item in scene.objects.items()}
        self._material: dict[int, int] = {}
        self._normal: dict[int, np.ndarray] = {}
        for index, part in enumerate(bundle.static_meshes()):
            corners = part.vertices.astype(np.float64)[part.faces]
            self._material[number[static_name(index)]] = part.material_index
            self._normal[number[static_name(index)]] = np.cross(
                corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            )
        for name, material, _ in vehicle_meshes(vehicles):
            if name in number:
                self._material[number[name]] = material

    def over_band(self, paths: PathSet, nodes_hz: np.ndarray) -> PathSet:
        """Gives paths the walls' answers at every frequency instead of those at the carrier.

        Args:
            paths: Paths with one sensing interaction each, amplitudes for each node.
            nodes_hz: The nodes [Hz], shape (node,).
        """
        if not len(paths):
            return paths
        freq_hz = np.append(nodes_hz, self._radio.centre_hz)
        amplitude = paths.amplitude.copy()
        walls = np.flatnonzero((paths.kinds != 0).sum(axis=1) > 1)
        for first in range(0, len(walls), _BLOCK):
            here = walls[first : first + _BLOCK]
            handed = self._handed(paths.select(here), freq_hz)
            carrier = handed[:, :, -1:]
            held = np.abs(carrier) > _CROSSED
            amplitude[here] *= np.where(held, handed[:, :, :-1] / np.where(held, carrier, 1.0), 1.0)
        return replace(paths, amplitude=amplitude)

    def _handed(self, paths: PathSet, freq_hz: np.ndarray) -> np.ndarray:
        """What antennas and walls make of each path, complex128, (path, port pair, frequency)."""
        sent, heard = _legs(paths)
        tx_owner, rx_owner = owners(self._layout)
        slants = self._radio.slants_deg
        to_points = [self._at_points(sent, tx_owner[paths.tx], s, freq_hz) for s in slants]
        from_points = [self._at_points(heard, rx_owner[paths.rx], s, freq_hz) for s in slants]
        # Points hand θ and φ on; seen from the other end φ points the other way.
        return np.stack(
            [
                to_points[i][0] * from_points[j][0] - to_points[i][1] * from_points[j][1]
                for i, j in ports(self._layout)
            ],
            axis=1,
        )

    def _at_points(
        self, legs: _Legs, owner: np.ndarray, slant_deg: float, freq_hz: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """θ and φ of the field that legs bring to their points, each shape (path, frequency)."""
        k = directions(legs.vertices)
        sent = of_sites(self._radio, slant_deg, k[:, 0], owner, self._devices)
        wave = np.repeat(sent[:, None].astype(np.complex128), len(freq_hz), axis=1)
        for corner in range(legs.kinds.shape[1]):
            met = corner < legs.walls
            for number in np.unique(legs.objects[met, corner]):
                here = np.flatnonzero(met & (legs.objects[:, corner] == number))
                mirrored = legs.kinds[here, corner] == SPECULAR
                normal = k[here, corner] - k[here, corner + 1]
                if not mirrored.all():
                    crossed = here[~mirrored]
                    normal[~mirrored] = self._normal[number][legs.primitives[crossed, corner]]
                name, thickness_m = self._materials[self._material[number]]
                material = (name, thickness_m, freq_hz)
                wave[here] = past_slab(wave[here], k[here, corner], normal, mirrored, material)
        last = k[np.arange(len(k)), legs.walls]
        flat = np.hypot(last[:, 0], last[:, 1])
        turned = flat > 1e-7
        cos_phi = np.where(turned, last[:, 0] / np.where(turned, flat, 1.0), 1.0)
        sin_phi = np.where(turned, last[:, 1] / np.where(turned, flat, 1.0), 0.0)
        theta = np.stack([cos_phi * last[:, 2], sin_phi * last[:, 2], -flat], axis=1)
        phi = np.stack([-sin_phi, cos_phi, np.zeros(len(k))], axis=1)
        return np.einsum("pnx,px->pn", wave, theta), np.einsum("pnx,px->pn", wave, phi)


class _Legs(NamedTuple):
    """One leg of each path, from the device to the point."""

    vertices: np.ndarray
    """Corners [m], the device first, shape (path, corner, 3)."""
    kinds: np.ndarray
    """What happens at each corner after the device, shape (path, corner - 2)."""
    objects: np.ndarray
    """Sionna's number of what stands there, of the same shape."""
    primitives: np.ndarray
    """Triangle of it, of the same shape."""
    walls: np.ndarray
    """Walls of each leg, shape (path,)."""


def _legs(paths: PathSet) -> tuple[_Legs, _Legs]:
    """The legs from the transmitter and, the other way round, from the receiver."""
    rows = np.arange(len(paths))[:, None]
    at = np.argmax(paths.kinds == SCATTERING, axis=1)
    count = (paths.kinds != 0).sum(axis=1)
    tables = paths.kinds, paths.objects, paths.primitives
    sent = _Legs(paths.vertices, paths.kinds, paths.objects, paths.primitives, at)
    back = np.maximum(count[:, None] + 1 - np.arange(paths.vertices.shape[1]), 0)
    corner = np.maximum(back[:, 1:-1] - 1, 0)
    kinds, objects, primitives = (table[rows, corner] for table in tables)
    heard = _Legs(paths.vertices[rows, back], kinds, objects, primitives, count - 1 - at)
    return sent, heard
