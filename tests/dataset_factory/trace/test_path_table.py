# SPDX-License-Identifier: Apache-2.0
"""Rows of path tables against closed forms, and their sum against the channel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.closed_forms import error_db
from rfgs_core.radio import DevicePose, Radio, layout, preset
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.images import SCATTERING, SPECULAR
from rfgs_core.radio.path_table import PathTable

MakeBundle = Callable[..., Bundle]


def one_way(radio: Radio, **options) -> Radio:
    """The radio with single antennas that hear other devices only."""
    return replace(radio, rx_rows=1, rx_cols=1, own_device_links="excluded", **options)


@pytest.fixture
def pair() -> list[DevicePose]:
    return [
        DevicePose("a", (0.5, 1.0, 1.2), (1.0, 0.0, 0.0, 0.0), "TRANSMITTER"),
        DevicePose("b", (3.5, 3.0, 2.0), (1.0, 0.0, 0.0, 0.0), "RECEIVER"),
    ]


def test_two_rays_have_their_closed_forms(
    make_bundle: MakeBundle, small_radio: Radio, pair: list[DevicePose], metal_floor: list
) -> None:
    from dataset_factory.trace import Tracer

    radio = one_way(small_radio)
    bundle = make_bundle(static=metal_floor, material="metal")
    tracer = Tracer(bundle, radio, pair, depth=1)
    table, spread = tracer.static_paths(), layout(radio, pair)
    start, end = spread.tx_xyz[0], spread.rx_xyz[0]
    ways = [end - start, end * [1, 1, -1] - start]
    lengths = np.array([np.linalg.norm(way) for way in ways])
    assert np.abs(table.delay_s - lengths / SPEED_OF_LIGHT).max() < 1e-6 / SPEED_OF_LIGHT
    assert table.kind[:, 0].tolist() == [0, SPECULAR]
    assert table.object[:, 0].tolist() == [0, 1]
    assert bundle.path_objects[0]["name"] == "room"
    for index, way in enumerate(ways):
        back = way * [-1, -1, 1] if index else -way
        for name, direction in (("departure", way), ("arrival", back)):
            zenith = np.arccos(direction[2] / lengths[index])
            assert abs(getattr(table, f"{name}_zenith_rad")[index] - zenith) < 1e-5
            azimuth = np.arctan2(direction[1], direction[0])
            assert abs(getattr(table, f"{name}_azimuth_rad")[index] - azimuth) < 1e-5
    friis = SPEED_OF_LIGHT / table.node_hz / (4 * np.pi * lengths[:, None])
    assert np.abs(np.abs(table.amplitude[:, 0]) / friis - 1).max() < 0.01
    assert np.abs(table.vertices[1, 1, 2]) < 1e-5
    assert not table.doppler_hz.any()
    assert error_db(table.channel(spread, radio.freq_hz), tracer.static()) < -60


def test_mirror_that_moves_shifts_its_path(
    make_bundle: MakeBundle,
    small_radio: Radio,
    pair: list[DevicePose],
    steel_sheet: tuple,
    velocity_m_s: np.ndarray,
) -> None:
    from dataset_factory.trace import Tracer

    radio = one_way(small_radio)
    bundle = make_bundle(
        static=[], vehicle=(steel_sheet[0] + np.float32([0, 2, 0]), steel_sheet[1])
    )
    table = Tracer(bundle, radio, pair, depth=1).paths(bundle.frame(1))
    spread = layout(radio, pair)
    row = np.flatnonzero(table.kind[:, 0] == SPECULAR)
    assert len(row) == 1 and table.object[row[0], 0] == bundle.path_objects[-1]["id"]
    # The sheet stands at y = 4.1 and only its way along y counts.
    image = spread.tx_xyz[0] * [1, -1, 1] + [0, 2 * 4.1, 0]
    way = spread.rx_xyz[0] - image
    longer_m_s = -2 * velocity_m_s[1] * way[1] / np.linalg.norm(way)
    expected = -longer_m_s * radio.centre_hz / SPEED_OF_LIGHT
    assert abs(table.doppler_hz[row[0]] - expected) < 1e-4 * abs(expected)
    assert table.delay_s[row[0]] == pytest.approx(np.linalg.norm(way) / SPEED_OF_LIGHT, rel=1e-6)


def test_rows_of_a_person_move_with_it(
    make_bundle: MakeBundle,
    small_radio: Radio,
    pair: list[DevicePose],
    coarse_capsule: tuple,
    velocity_m_s: np.ndarray,
) -> None:
    from dataset_factory.trace import Tracer

    radio = one_way(small_radio)
    bundle = make_bundle(static=[], mover=coarse_capsule)
    table = Tracer(bundle, radio, pair, depth=1).paths(bundle.frame(1))
    body = table.select(table.kind[:, 0] == SCATTERING)
    assert len(body) > 2
    assert [bundle.path_objects[i - 1]["name"] for i in set(body.object[:, 0])] == ["mover"]
    corner = body.vertices[:, 1] - [1.7, 2.1, 0.85]
    assert np.linalg.norm(corner / [0.25, 0.18, 0.8], axis=1).max() < 1.02
    moved = body.vertices.astype(np.float64)
    step_s = 1e-6
    moved[:, 1] += velocity_m_s * step_s
    length_m = np.linalg.norm(np.diff(moved, axis=1), axis=2).sum(axis=1)
    rest_m = np.linalg.norm(np.diff(body.vertices.astype(np.float64), axis=1), axis=2).sum(axis=1)
    expected = -(length_m - rest_m) / step_s * radio.centre_hz / SPEED_OF_LIGHT
    fastest = 2 * np.linalg.norm(velocity_m_s) * radio.centre_hz / SPEED_OF_LIGHT
    assert np.abs(body.doppler_hz - expected).max() < 0.02 * fastest
    assert np.abs(body.doppler_hz).max() < fastest


@pytest.mark.parametrize("antennas", [1, 2])
def test_rows_add_up_to_the_channel(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose], antennas: int
) -> None:
    from dataset_factory.trace import Tracer

    radio = replace(small_radio, rx_rows=antennas, rx_cols=antennas)
    tracer = Tracer(person_bundle, radio, two_devices, depth=2)
    frame = person_bundle.frame(1)
    trace = tracer.trace(frame)
    channel = tracer.samples(frame, trace)[0].astype(np.complex128)
    table, spread = tracer.paths(frame, trace), layout(radio, two_devices)
    found = table.channel(spread, radio.freq_hz)
    moving = channel - tracer.static()
    limits = (-60.0, -35.0) if antennas == 1 else (-40.0, -15.0)
    assert error_db(found, channel) < limits[0]
    assert error_db(found - tracer.static(), moving) < limits[1]
    link = table.link(spread, 1, 0, radio.freq_hz)
    assert np.abs(link - found[1, 0]).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(("name", "limit_db"), [("mmwave", -30.0), ("uwb", -30.0)])
def test_rows_of_radar_presets_add_up(
    person_bundle: Bundle, two_devices: list[DevicePose], name: str, limit_db: float
) -> None:
    from dataset_factory.trace import Tracer

    # One antenna each, so that the rows' plane waves are no limit.
    single = {"tx_rows": 1, "tx_cols": 1, "rx_rows": 1, "rx_cols": 1}
    radio = replace(preset(name), **single)
    tracer = Tracer(person_bundle, radio, two_devices, depth=radio.deepest)
    frame = person_bundle.frame(1)
    trace = tracer.trace(frame)
    channel = tracer.samples(frame, trace)[0].astype(np.complex128)
    table, spread = tracer.paths(frame, trace), layout(radio, two_devices)
    found = table.channel(spread, radio.freq_hz)
    assert error_db(found, channel) < limit_db


def test_ports_have_amplitudes_of_their_own(
    make_bundle: MakeBundle, small_radio: Radio, pair: list[DevicePose], coarse_capsule: tuple
) -> None:
    from dataset_factory.trace import Tracer

    radio = one_way(small_radio, polarization="VH", pattern="dipole")
    bundle = make_bundle(mover=coarse_capsule)
    tracer = Tracer(bundle, radio, pair, depth=1)
    frame = bundle.frame(1)
    trace = tracer.trace(frame)
    table = tracer.paths(frame, trace)
    assert table.amplitude.shape[1] == 4
    found = table.channel(layout(radio, pair), radio.freq_hz)
    assert error_db(found, tracer.samples(frame, trace)[0]) < -50


def test_tables_do_not_depend_on_what_was_traced_before(
    person_bundle: Bundle, small_radio: Radio, two_devices: list[DevicePose]
) -> None:
    from dataclasses import fields

    from dataset_factory.trace import Tracer

    radio = one_way(small_radio)
    first = Tracer(person_bundle, radio, two_devices, depth=2)
    second = Tracer(person_bundle, radio, two_devices, depth=2)
    second.paths(person_bundle.frame(2))
    tables = [tracer.paths(person_bundle.frame(1)) for tracer in (first, second)]
    for spec in fields(PathTable):
        values = [getattr(table, spec.name).tobytes() for table in tables]
        assert values[0] == values[1], spec.name
