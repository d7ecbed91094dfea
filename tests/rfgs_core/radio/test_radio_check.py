# SPDX-License-Identifier: Apache-2.0
"""Scenes a radio cannot be traced in are refused with a remedy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import PRESETS, DevicePose, preset
from rfgs_core.radio.check import check, check_devices, winding_number
from rfgs_core.simulate.geometry.room import SlabMaterial, box_room
from rfgs_core.simulate.surface.movers import Movers
from rfgs_core.simulate.tracer import FastTracer

BOUNDS_M = np.array([[0.0, 0.0, 0.0], [6.0, 5.0, 2.7]])
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(low: list[float], high: list[float]) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    vertices = np.array(low) + corners * (np.array(high) - np.array(low))
    faces = [tri for a, b, c, d in QUADS for tri in ((a, b, c), (a, c, d))]
    return vertices.astype(np.float32), np.array(faces, np.int32)


def at(*position: float) -> DevicePose:
    return DevicePose("ap", position, (1.0, 0.0, 0.0, 0.0))


def test_a_closed_box_winds_once_around_its_inside() -> None:
    points = np.array([[0.5, 0.5, 0.5], [0.01, 0.5, 0.99], [1.5, 0.5, 0.5], [9.0, 9.0, 9.0]])
    turns = winding_number(points, *box([0, 0, 0], [1, 1, 1]))
    assert np.allclose(np.abs(turns), [1, 1, 0, 0], atol=1e-6)


def test_presets_suit_a_living_room() -> None:
    materials = [{"name": "Wall", "radio_material": "plasterboard"}]
    for radio in PRESETS.values():
        assert check(radio, BOUNDS_M, materials) == []


def test_delays_that_alias_are_refused() -> None:
    coarse = replace(preset("wifi"), num_subcarriers=8)
    problems = check(coarse, BOUNDS_M, [])
    assert len(problems) == 1 and "15.0 m" in problems[0]
    # 2 · |(6, 5, 2.7)| + 5 = 21.53 m; 160 MHz · 21.53 m / c = 11.5 subcarriers.
    assert "reach 21.5 m; use wifi, " in problems[0]
    assert "`like: wifi` and `num_subcarriers: 12`" in problems[0]
    assert check(replace(coarse, num_subcarriers=12), BOUNDS_M, []) == []


@pytest.mark.parametrize(
    ("radio", "kind", "words"),
    [
        ("wifi", "floorboard", ["'Parquet'", "50 to 100 GHz", "5.72 to 5.88 GHz", "wood"]),
        ("mmwave", "brick", ["'Parquet'", "1 to 40 GHz", "60 to 64 GHz"]),
        ("wifi", "kryptonite", ["unknown radio material 'kryptonite'"]),
    ],
)
def test_materials_outside_their_band_are_named(radio: str, kind: str, words: list[str]) -> None:
    problems = check(preset(radio), BOUNDS_M, [{"name": "Parquet", "radio_material": kind}])
    assert len(problems) == 1 and all(word in problems[0] for word in words), problems


def test_devices_in_furniture_or_outside_are_named() -> None:
    room, cupboard = box([0, 0, 0], [6, 5, 2.7]), box([1, 1, 0], [2, 2, 2])
    meshes = [("Room", *room), ("Cupboard", *cupboard)]
    radio = preset("wifi")
    assert check_devices(radio, BOUNDS_M, [at(3.0, 3.0, 1.0)], meshes) == []
    inside = check_devices(radio, BOUNDS_M, [at(1.5, 1.5, 1.0)], meshes)
    assert len(inside) == 1 and "'Cupboard'" in inside[0] and "'ap'" in inside[0]
    outside = check_devices(radio, BOUNDS_M, [at(-1.0, 1.5, 1.0)], meshes)
    assert len(outside) == 1 and "outside the scene" in outside[0]


def test_arrays_that_reach_through_a_wall_are_named() -> None:
    # 16 elements 0.2 m apart reach 1.5 m to both sides of the device.
    problems = check_devices(preset("uwb"), BOUNDS_M, [at(0.2, 1.05, 1.2)], [])
    assert len(problems) == 1 and "3 of 16 antennas of device 'ap'" in problems[0]
    assert check_devices(preset("uwb"), BOUNDS_M, [at(0.2, 2.5, 1.2)], []) == []


def test_devices_in_the_same_place_are_refused_where_they_hear_each_other() -> None:
    commodity = preset("wifi_commodity")
    devices = [replace(at(1.0, 1.0, 1.0 + 0.5 * k), name=f"ap{k}") for k in range(3)]
    assert check_devices(commodity, BOUNDS_M, devices, []) == []
    devices[2] = replace(devices[0], name="twin")
    (problem,) = check_devices(commodity, BOUNDS_M, devices, [])
    assert "devices 'ap0' and 'twin'" in problem and "move one" in problem
    # Radars hear only themselves, and a transmitter below its receiver may have a twin.
    assert check_devices(preset("mmwave"), BOUNDS_M, devices, []) == []
    assert check_devices(preset("wifi"), BOUNDS_M, devices, []) == []


def test_the_tracer_refuses_places_without_a_channel() -> None:
    commodity, nobody = preset("wifi_commodity"), Movers.none()
    room = box_room(np.zeros(3), np.array([5.0, 4.0, 2.6]), SlabMaterial("plasterboard", 0.0125))
    first = at(1.0, 1.0, 1.0)
    with pytest.raises(RfgsError, match="are in the same place; move one"):
        FastTracer(room, nobody, nobody, commodity, [first, replace(first, name="twin")])
    with pytest.raises(RfgsError, match="'wifi_commodity' has no link with 1 devices"):
        FastTracer(room, nobody, nobody, commodity, [first])
    assert FastTracer(room, nobody, nobody, preset("mmwave"), [first]).static().any()
