# SPDX-License-Identifier: Apache-2.0
"""Walls on the way to a person answer at every frequency, not at the carrier alone."""

from __future__ import annotations

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.scene.surroundings import room_of
from rfgs_core.radio import Radio
from rfgs_core.radio.images import REFRACTION, SCATTERING, SPECULAR
from rfgs_core.radio.layout import DevicePose
from rfgs_core.radio.reflection import slab, slab_delay_s
from rfgs_core.simulate.paths.path_set import PathSet
from rfgs_core.simulate.shadow.environment import node_frequencies


def normal_way(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle of a triangle [m], shape (3, 3), and its unit normal."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return corners.mean(axis=0), normal / np.linalg.norm(normal)


@pytest.mark.parametrize("kinds", [(REFRACTION, SCATTERING, REFRACTION), (SPECULAR, SCATTERING, 0)])
def test_a_slab_met_at_right_angles_has_its_closed_form_over_the_band(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose], kinds: tuple
) -> None:
    from dataset_factory.trace import Tracer

    tracer = Tracer(person_bundle, small_radio, two_devices, depth=2)
    # A wall: upright antennas send nothing to floor and ceiling.
    name, part = next(
        (name, part)
        for name, part in zip(
            tracer._environment.meshes.names, person_bundle.static_meshes(), strict=False
        )
        if np.ptp(part.vertices[:, 2]) > 1.0
    )
    number, material = int(tracer._bodies.scene.objects[name].object_id), part.material_index
    middle, normal = normal_way(part.vertices.astype(np.float64)[part.faces[0]])
    device = middle + normal
    if kinds[0] == REFRACTION:
        # There through the wall and back the same way.
        corners = np.stack([device, middle, middle - 2.0 * normal, middle, device])
        passes = 2
    else:
        # To the wall, back past the device to the point, and from there straight home.
        corners = np.stack([device, middle, middle + 2.0 * normal, device, device])
        passes = 1
    nodes_hz = np.linspace(5.0e9, 6.5e9, 7)
    one = np.ones((1, 1, len(nodes_hz)), dtype=np.complex128)
    table = np.array([kinds], dtype=np.int64)
    met = np.where((table == 0) | (table == SCATTERING), 0, number)
    path = PathSet(
        np.zeros(1, np.int64), np.zeros(1, np.int64), one, corners[None], table, 0 * met, met
    )
    found = tracer._walls.over_band(path, nodes_hz).amplitude[0, 0]

    row = room_of(person_bundle).materials[material]
    factors = slab(
        row.name, row.thickness_m, np.append(nodes_hz, small_radio.centre_hz), np.ones(1)
    )
    answer = (factors.passed_te if kinds[0] == REFRACTION else factors.reflected_te)[0]
    assert np.allclose(found, (answer[:-1] / answer[-1]) ** passes, rtol=1e-9)
    # A slab does answer differently over such a band.
    assert np.abs(found - 1.0).max() > 0.05


def test_nodes_follow_the_delay_of_the_slowest_slab_that_is_open(small_radio: Radio) -> None:
    thick = slab_delay_s([("concrete", 0.2), ("plasterboard", 0.0125)], 5.8e9)
    # ITU-R P.2040-4, table 3: concrete has η = 5.24 − jσ/(ωε₀), σ = 0.0462 f^0.7822.
    loss = 0.0462 * 5.8**0.7822 / (2.0 * np.pi * 5.8e9 * 8.8541878128e-12)
    index = np.sqrt(5.24 - 1j * loss).real
    assert thick == pytest.approx(0.2 * index / 299792458.0, rel=1e-9)
    # At 60 GHz nothing passes 20 cm of concrete.
    open_only = slab_delay_s([("concrete", 0.2), ("wood", 0.03)], 60e9)
    loss = 0.0047 * 60.0**1.0718 / (2.0 * np.pi * 60e9 * 8.8541878128e-12)
    assert open_only == pytest.approx(0.03 * np.sqrt(1.99 - 1j * loss).real / 299792458.0, rel=1e-9)
    nodes = node_frequencies(small_radio, thick)
    turn_rad = 2.0 * np.pi * np.diff(nodes).max() * thick
    assert turn_rad <= 0.28 + 1e-9


def test_walls_at_another_frequency_are_those_that_sionna_traces_there(
    person_bundle: Bundle,
    small_radio: Radio,
    two_devices: list[DevicePose],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Sionna RT itself, asked for the same paths at another carrier, shares nothing of ours."""
    import sionna.rt as rt

    from dataset_factory.trace import Tracer
    from dataset_factory.trace.rays.scene import set_frequency

    # The body absorbs at every frequency; Sionna asks its material for a table that it has not.
    monkeypatch.setattr(
        rt.AbsorberRadioMaterial, "frequency_update", lambda self: None, raising=False
    )
    tracer = Tracer(person_bundle, small_radio, two_devices, depth=2)
    body = tracer._bodies.points(person_bundle.frame(person_bundle.frames[0]).vertices)
    other_hz = 1.06 * small_radio.centre_hz
    at = {}
    for freq_hz in (small_radio.centre_hz, other_hz):
        set_frequency(tracer._bodies.scene, freq_hz)
        at[freq_hz] = tracer._bounces.paths(body, tracer._environment.around)
    rows = [
        [
            tuple(row)
            for row in np.column_stack(
                [paths.tx, paths.rx, paths.kinds, paths.objects, paths.primitives]
            )
        ]
        for paths in at.values()
    ]
    places = {row: place for place, row in enumerate(rows[0])}
    assert len(places) == len(rows[0])
    both = np.array([(places[row], i) for i, row in enumerate(rows[1]) if row in places])
    assert len(both) > 0.9 * max(map(len, rows)) > 100
    carrier, traced = at[small_radio.centre_hz].select(both[:, 0]), at[other_hz].select(both[:, 1])
    # Amplitudes of Sionna carry λ once; that and the facets are not the walls' to answer for.
    wanted = traced.amplitude[:, 0, 0] * other_hz / small_radio.centre_hz
    found = tracer._walls.over_band(carrier, np.array([other_hz])).amplitude[:, 0, 0]
    power = np.sum(np.abs(wanted) ** 2)
    assert np.sum(np.abs(found - wanted) ** 2) < 1e-6 * power
    assert np.sum(np.abs(carrier.amplitude[:, 0, 0] - wanted) ** 2) > 1e-4 * power
