# SPDX-License-Identifier: Apache-2.0
"""Paths by way of everything but people, traced again only where a vehicle has moved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import sionna.rt as rt

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.surroundings import room_of
from dataset_factory.trace.rays.fields import Fields, SceneMeshes
from dataset_factory.trace.rays.paths import path_set
from dataset_factory.trace.rays.scene import (
    Group,
    add_antennas,
    environment_scene,
    move_vehicles,
    set_frequency,
)
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.images import DIFFUSE
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.levels import amplitude_of
from rfgs_core.radio.sites import centres, measured_pairs, owners
from rfgs_core.simulate.geometry import (
    Faces,
    Sight,
    SpecularPaths,
    Surroundings,
    faces_of,
    specular_paths,
)
from rfgs_core.simulate.paths.path_set import PathSet, joined, merged
from rfgs_core.simulate.shadow.environment import WIDE_BAND, node_frequencies
from rfgs_core.simulate.surface.movers import Movers

#: Interactions of an environment path; a fourth would change bistatic links by −39 dB.
MAX_DEPTH = 3
#: Rays per transmitter, for diffuse reflections.
NUM_SAMPLES = 300_000
#: Room for diffuse paths per transmitter.
MAX_PATHS = 20_000
#: Receiving sites per call, which bounds memory to 1.5 GB.
SITES_AT_ONCE = 8


class Environment:
    """The scene without people, between centres of sites, ready to be traced."""

    def __init__(
        self,
        bundle: Bundle,
        radio: Radio,
        layout: Layout,
        devices: list[DevicePose],
        seed: int,
        vehicles: Movers | None = None,
        faces: Callable[..., Faces] = faces_of,
    ) -> None:
        """Builds the scene.

        Args:
            bundle: Scene bundle.
            radio: Radio; wide bands are traced at each node frequency.
            layout: Antenna elements; pairs of sites without a measured link are left out.
            devices: Poses of the devices.
            seed: Seed of the rays, the same for a whole sequence.
            vehicles: Rigid metal that `paths` moves; None leaves everything that moves out.
            faces: Gathers the scene's triangles into faces that mirror; `faces_of` with other
                numbers shows whether its own are enough.
        """
        self._radio, self._layout, self._seed = radio, layout, seed
        self._devices, self._groups = devices, groups(layout)
        self._vehicles, self._faces = vehicles, faces
        self._nodes = node_frequencies(radio, room_of(bundle).slab_delay_s(radio.centre_hz))
        self._scatters = any(row["scattering_coefficient"] > 0.0 for row in bundle.materials)
        self._scene = environment_scene(bundle, radio, vehicles)
        self.meshes = SceneMeshes(bundle, vehicles)
        #: Faces of the scene and what the sites see of them, where it was traced last.
        self.around: Surroundings | None = None
        self._sight = Sight(*centres(layout))
        self._fields, self._solver = Fields(), rt.PathSolver(deterministic=True)

    @property
    def scene(self) -> rt.Scene:
        """The scene that is traced."""
        return self._scene

    @property
    def reflects(self) -> bool:
        """Whether there is anything to bounce off."""
        return len(self.meshes.names) > 0

    def paths(self, vertices: np.ndarray | None = None) -> PathSet:
        """Traces the scene; the result does not depend on what was traced before.

        Specular paths are found by images, without rays, so that both directions have the same
        ones. Diffuse reflections alone come from rays.

        Args:
            vertices: Where the vehicles' vertices are [m], shape (V, 3).

        Returns:
            Paths with one amplitude per node frequency, times frequency over the band's centre:
            an antenna's aperture goes with the wavelength, so what is left is smooth in
            frequency.
        """
        if self._vehicles is not None and vertices is not None:
            move_vehicles(self._scene, self._vehicles, vertices)
        triangles, mesh = self.meshes.triangles(vertices)
        self.around = self._sight.of(self._faces(triangles, mesh), self.meshes.moves[mesh])
        found = specular_paths(self.around, measured_pairs(self._layout), MAX_DEPTH)
        parts = []
        for group in self._groups:
            add_antennas(self._scene, self._layout, self._devices, group)
            parts.append(self._at_nodes(self._specular(found, group), group))
            if self._scatters:
                rays = self._at_centre(self._scattered, group)
                parts.append(rays.select((rays.kinds == DIFFUSE).any(axis=1)))
        return merged(parts)

    def _specular(self, found: SpecularPaths, group: Group) -> Callable[[float], rt.Paths]:
        """What gives waves along the paths of a group, whose antennas are in the scene."""
        here = np.isin(found.tx, group[0]) & np.isin(found.rx, group[1])
        some = SpecularPaths(*(column[here] for column in found))
        tx, rx = np.searchsorted(group[0], some.tx), np.searchsorted(group[1], some.rx)
        some = some._replace(tx=tx, rx=rx)
        return lambda freq_hz: self._fields.along(self._scene, self.meshes, some, freq_hz)

    def _scattered(self, freq_hz: float) -> rt.Paths:
        """Paths found by rays at one frequency, those with diffuse reflections among them."""
        set_frequency(self._scene, freq_hz)
        return self._solver(
            self._scene,
            max_depth=MAX_DEPTH,
            samples_per_src=NUM_SAMPLES,
            max_num_paths_per_src=MAX_PATHS,
            synthetic_array=True,
            diffuse_reflection=True,
            refraction=True,
            seed=self._seed,
        )

    def _at_nodes(self, traced: Callable[[float], rt.Paths], group: Group) -> PathSet:
        """Paths between the sites of a group with one amplitude for each node frequency."""
        nodes = self._nodes
        return joined([self._read(traced(float(f)), group, float(f)) for f in nodes])

    def _at_centre(self, traced: Callable[[float], rt.Paths], group: Group) -> PathSet:
        """The same of rays, with the amplitudes of a narrow band's centre throughout."""
        nodes, centre_hz = self._nodes, self._radio.centre_hz
        if self._radio.bandwidth_hz / centre_hz > WIDE_BAND:
            return self._at_nodes(traced, group)
        at_centre = self._read(traced(centre_hz), group, centre_hz)
        return replace(at_centre, amplitude=np.repeat(at_centre.amplitude, len(nodes), axis=2))

    def _read(self, paths: rt.Paths, group: Group, freq_hz: float) -> PathSet:
        """Sionna's paths between the sites of a group, one amplitude each."""
        tx_centres, rx_centres = centres(self._layout)
        found = path_set(paths, tx_centres[group[0]], rx_centres[group[1]])
        amplitude = found.amplitude * (freq_hz / self._radio.centre_hz)
        found = replace(found, tx=group[0][found.tx], rx=group[1][found.rx], amplitude=amplitude)
        tx_owner, rx_owner = owners(self._layout)
        straight = (found.kinds == 0).all(axis=1) & (tx_owner[found.tx] == rx_owner[found.rx])
        found.amplitude[straight] *= amplitude_of(-self._radio.isolation_db)
        return found.select(measured_pairs(self._layout)[found.tx, found.rx])


def groups(layout: Layout) -> list[Group]:
    """Sites to trace together, so that all measured pairs are and memory stays bounded."""
    wanted = measured_pairs(layout)
    tx, rx = (np.arange(count) for count in wanted.shape)
    if len(tx) <= SITES_AT_ONCE and len(rx) <= SITES_AT_ONCE:
        return [(tx, rx)]
    starts = range(0, len(rx), SITES_AT_ONCE)
    if len(tx) == len(rx) and (wanted == np.eye(len(tx), dtype=bool)).all():
        return [(tx[i : i + SITES_AT_ONCE], rx[i : i + SITES_AT_ONCE]) for i in starts]
    return [(tx, rx[i : i + SITES_AT_ONCE]) for i in starts]
