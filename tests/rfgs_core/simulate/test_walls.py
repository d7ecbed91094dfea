# SPDX-License-Identifier: Apache-2.0
"""A room told from its empty channel alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import DevicePose, layout, preset
from rfgs_core.radio.placement import place_devices
from rfgs_core.simulate.geometry.room import Room, SlabMaterial, box_room, empty_room
from rfgs_core.simulate.surface.movers import Movers
from rfgs_core.simulate.tracer import FastTracer
from rfgs_core.simulate.walls import find_walls, room_of_walls

SIDES = {"x-": -2.4, "x+": 2.9, "y-": -1.9, "y+": 2.2, "z-": 0.0, "z+": 2.6}
BOX = np.array([[SIDES[f"{axis}-"] for axis in "xyz"], [SIDES[f"{axis}+"] for axis in "xyz"]])
CONCRETE = SlabMaterial("concrete", 0.2)
RADIO = replace(preset("wifi"), rx_rows=4, rx_cols=4, num_subcarriers=32)


def devices() -> list[DevicePose]:
    return place_devices(RADIO, BOX)


def empty_channel(room: Room) -> np.ndarray:
    nobody = Movers.none()
    return FastTracer(room, nobody, nobody, RADIO, devices()).static()


def test_six_walls_are_found_where_they_stand() -> None:
    room = box_room(BOX[0], BOX[1], CONCRETE)
    walls = find_walls(empty_channel(room), layout(RADIO, devices()), RADIO)
    assert {wall.name for wall in walls} == set(SIDES)
    off_m = {wall.name: abs(wall.at_m - SIDES[wall.name]) for wall in walls}
    # The range resolution is 0.94 m. Upright antennas hear floor and ceiling worse: what these
    # reflect changes its sign near Brewster's angle, from one element to another.
    assert max(off_m[name] for name in ("x-", "x+", "y-", "y+")) < 0.01
    assert max(off_m.values()) < 0.25


def test_one_wall_alone_is_one_wall_and_its_material() -> None:
    whole = box_room(BOX[0], BOX[1], CONCRETE)
    only = Room(whole.triangles[2:4], whole.mesh[2:4], whole.material[2:4], (CONCRETE,), "one wall")
    walls = find_walls(empty_channel(only), layout(RADIO, devices()), RADIO)
    assert [wall.name for wall in walls] == ["x+"]
    assert walls[0].at_m == pytest.approx(SIDES["x+"], abs=0.01)
    told = room_of_walls(walls, RADIO)
    assert len(told.triangles) == 2
    np.testing.assert_allclose(told.triangles[..., 0], walls[0].at_m)
    assert "radio alone: x+" in told.source
    assert len(room_of_walls(walls, RADIO, BOX).triangles) == 12


def test_noise_and_open_space_have_no_walls() -> None:
    elements = layout(RADIO, devices())
    rng = np.random.default_rng(3)
    shape = (*elements.measured.shape, RADIO.num_subcarriers)
    noise = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    assert find_walls(noise, elements, RADIO) == []
    assert find_walls(empty_channel(empty_room()), elements, RADIO) == []
    with pytest.raises(RfgsError, match="hears no wall"):
        room_of_walls([], RADIO)
    with pytest.raises(RfgsError, match="csi_static is zero"):
        find_walls(np.zeros(shape, complex), elements, RADIO)


def test_phases_between_devices_do_not_matter() -> None:
    elements = layout(RADIO, devices())
    csi = empty_channel(box_room(BOX[0], BOX[1], CONCRETE))
    turn = np.exp(2j * np.pi * np.random.default_rng(1).random(4))
    turned = csi * (turn[elements.tx_device][:, None] / turn[elements.rx_device])[..., None]
    one, other = (find_walls(channel, elements, RADIO) for channel in (csi, turned))
    assert [wall.name for wall in one] == [wall.name for wall in other]
    np.testing.assert_allclose([w.at_m for w in one], [w.at_m for w in other], atol=1e-4)


@pytest.mark.parametrize(
    "changes",
    [
        {"isolation_db": 40.0},
        {"isolation_db": 40.0, "own_device_links": "only"},
        {"pattern": "tr38901"},
    ],
)
def test_neither_isolation_nor_pattern_turns_walls_into_metal(changes: dict) -> None:
    """What walls reflect is told beside a line of sight that has lost its level."""
    radio = replace(RADIO, **changes)
    room = box_room(BOX[0], BOX[1], SlabMaterial("plasterboard", 0.0125))
    places, nobody = place_devices(radio, BOX), Movers.none()
    static = FastTracer(room, nobody, nobody, radio, places).static()
    walls = find_walls(static, layout(radio, places), radio)
    upright = [wall.reflection for wall in walls if wall.axis < 2]
    assert len(upright) == 4
    # Plasterboard reflects 0.2 to 0.4 over the angles that are met.
    assert 0.08 < min(upright) and max(upright) < 0.7
