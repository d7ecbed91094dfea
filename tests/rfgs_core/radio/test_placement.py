# SPDX-License-Identifier: Apache-2.0
"""Placed devices stand inside the scene, where their rule says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import layout, place_devices, preset
from rfgs_core.radio.layout import rotation

BOUNDS_M = np.array([[-1.0, 0.5, 0.25], [5.0, 4.5, 2.95]])


@pytest.mark.parametrize("count", [1, 3, 4])
def test_placed_devices_stand_inside_and_face_the_centre(count: int) -> None:
    radio = replace(preset("wifi"), num_devices=count)
    devices = place_devices(radio, BOUNDS_M)
    assert len({device.name for device in devices}) == len(devices) == count
    assert len({device.position_m[:2] for device in devices}) == count
    centre = BOUNDS_M.mean(axis=0)
    for index, device in enumerate(devices):
        position = np.array(device.position_m)
        assert (position >= BOUNDS_M[0] + [0.2, 0.2, 0]).all()
        assert (position <= BOUNDS_M[1] - [0.2, 0.2, 0]).all()
        # Above the floor, which is not at z = 0 here.
        assert position[2] == pytest.approx(0.25 + (1.2, 2.2)[index % 2])
        boresight, up = rotation(device.quat_wxyz)[:, [0, 2]].T
        towards = (centre - position)[:2]
        np.testing.assert_allclose(boresight[:2], towards / np.linalg.norm(towards), atol=1e-12)
        np.testing.assert_allclose(up, [0, 0, 1], atol=1e-12)


def test_more_devices_than_corners_do_not_stand_in_each_other() -> None:
    """They did, in silence, so that two devices heard each other over 0.3 m."""
    radio = replace(preset("wifi"), num_devices=6)
    with pytest.raises(RfgsError, match=r"6 devices in four corners .* walls or circle"):
        place_devices(radio, BOUNDS_M)
    walls = place_devices(replace(radio, placement="walls"), BOUNDS_M)
    assert len({device.position_m[:2] for device in walls}) == 6


def test_four_devices_go_round_counter_clockwise() -> None:
    devices = place_devices(preset("wifi"), BOUNDS_M)
    corners = [tuple(round(x, 6) for x in device.position_m[:2]) for device in devices]
    assert corners == [(-0.8, 0.7), (4.8, 0.7), (4.8, 4.3), (-0.8, 4.3)]


def test_arrays_along_walls_stay_inside_and_look_inwards() -> None:
    radio = preset("uwb")
    devices = place_devices(radio, BOUNDS_M)
    elements = layout(radio, devices)
    low, high = BOUNDS_M + np.array([[0.2, 0.2, 0.0], [-0.2, -0.2, 0.0]])
    assert len(elements.tx_xyz) == 4 and len(elements.rx_xyz) == 64
    for xyz in (elements.tx_xyz, elements.rx_xyz):
        assert (xyz >= low - 1e-9).all() and (xyz <= high + 1e-9).all()
    walls = []
    for index, device in enumerate(devices):
        boresight = rotation(device.quat_wxyz)[:, 0]
        array = elements.rx_xyz[elements.rx_device == index]
        # The array runs along one wall: it has no extent along its own boresight.
        assert np.ptp(array @ boresight) == pytest.approx(0.0, abs=1e-9)
        away = (np.array(device.position_m) - low) @ boresight
        away = away if boresight.sum() > 0 else (high - device.position_m) @ -boresight
        assert away == pytest.approx(0.0, abs=1e-9)
        walls.append(tuple(np.round(boresight).astype(int)))
    assert walls == [(0, 1, 0), (-1, 0, 0), (0, -1, 0), (1, 0, 0)]


def test_a_corridor_takes_two_arrays_along_each_long_wall() -> None:
    corridor = np.array([[0.0, 0.0, 0.0], [10.0, 2.0, 2.5]])
    radio = preset("uwb")
    elements = layout(radio, place_devices(radio, corridor))
    assert sorted(np.unique(np.round(elements.rx_xyz[:, 1], 6))) == [0.2, 1.8]
    for wall in (0.2, 1.8):
        along = np.sort(elements.rx_xyz[np.isclose(elements.rx_xyz[:, 1], wall), 0])
        assert len(along) == 32 and np.diff(along).min() > 0.19


def test_arrays_longer_than_the_walls_are_refused() -> None:
    closet = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 2.5]])
    with pytest.raises(RfgsError, match=r"4 arrays of 3 m do not fit along walls of 1\.60"):
        place_devices(preset("uwb"), closet)
