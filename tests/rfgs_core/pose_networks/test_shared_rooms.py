# SPDX-License-Identifier: Apache-2.0
"""What pose networks learn from: clips and channels of rooms, and what they are judged beside."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
import torch

from rfgs_core.errors import RfgsError
from rfgs_core.pose_networks.picture import central_elements, pictures
from rfgs_core.pose_networks.rooms import few_antennas
from rfgs_core.pose_networks.trial import Trial
from rfgs_core.radio import layout
from rfgs_core.radio.placement import place_devices
from rfgs_core.radio.presets import preset
from rfgs_core.worlds.moments import ONE_ROOM_M, followed
from rfgs_core.worlds.world import Place, WorldSettings, random_world


def test_clips_of_one_room_share_room_devices_and_people() -> None:
    done = list(islice(followed(preset("mmwave"), 0, 4, one_room=True), 6))
    rooms = {id(moment.room) for one in done for moment in one.moments}
    assert len(rooms) == 1
    devices = [moment.sight.layout.rx_xyz for one in done for moment in one.moments]
    assert all((each == devices[0]).all() for each in devices)
    assert 1 < len({id(one.figure) for one in done}) <= 4
    for one in done:
        middles = np.array([one.figure.middle(moment.pose)[:2] for moment in one.moments])
        assert (middles > ONE_ROOM_M[0, :2]).all()
        assert (middles < ONE_ROOM_M[1, :2]).all()
        # Nobody moves faster than a run from one moment to the next, 0.1 s later.
        assert (np.linalg.norm(np.diff(middles, axis=0), axis=1) < 0.4).all()
        centres = np.array([moment.centre[:2] for moment in one.moments])
        assert (np.linalg.norm(centres - middles, axis=1) < 0.5).all()


def test_clips_of_random_rooms_are_each_in_one() -> None:
    done = list(islice(followed(preset("mmwave"), 0, 3), 4))
    assert [len({id(moment.room) for moment in one.moments}) for one in done] == [1] * 4
    assert len({id(one.moments[0].room) for one in done}) == 4


def test_the_middle_of_large_arrays_is_that_of_small_ones() -> None:
    radio = preset("wifi")
    small = few_antennas(radio)
    assert (small.rx_rows, small.rx_cols) == (4, 4)
    large_at, small_at = (layout(kind, place_devices(kind, ONE_ROOM_M)) for kind in (radio, small))
    for device in range(4):
        mine = large_at.rx_xyz[central_elements(large_at, device)]
        np.testing.assert_allclose(mine, small_at.rx_xyz[central_elements(small_at, device)])


def channel() -> tuple[np.ndarray, np.ndarray, Place]:
    """An empty room's channel by chance, that of one frame, and where devices stand."""
    radio = few_antennas(preset("wifi"))
    place = Place(ONE_ROOM_M, place_devices(radio, ONE_ROOM_M))
    shape = (*layout(radio, place.devices).measured.shape, 64)
    rng = np.random.default_rng(0)
    static = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    return static, 0.01 * (rng.normal(size=shape) + 1j * rng.normal(size=shape)), place


def test_pictures_of_an_empty_room_are_blank_whatever_clocks_do() -> None:
    static, change, place = channel()
    elements = layout(few_antennas(preset("wifi")), place.devices)
    clock = np.exp(1j * (0.7 + 0.02 * np.arange(64)))
    blank = pictures(np.stack([static, static * clock]), static, elements)
    assert blank.shape == (2, 16 * 4, 2 * 4 * 32)
    np.testing.assert_allclose(blank, 0.0, atol=1e-4)
    heard = pictures(np.stack([static + change, (static + change) * clock]), static, elements)
    assert np.abs(heard[0]).max() > 1e-3
    np.testing.assert_allclose(heard[0], heard[1], atol=1e-4)
    # The first half is the change of amplitudes over the pair's root of mean power.
    rows = central_elements(elements, 0)[0]
    still, now = static[0, rows, ::2], (static + change)[0, rows, ::2]
    block = static[0, central_elements(elements, 0).ravel(), ::2]
    wanted = (np.abs(now) - np.abs(still)) / np.sqrt(np.mean(np.abs(block) ** 2))
    np.testing.assert_allclose(heard[0, 0, :128], wanted.ravel(), atol=1e-5)


def test_rooms_of_one_layout_differ_in_all_else() -> None:
    radio = few_antennas(preset("wifi"))
    place = Place(ONE_ROOM_M, place_devices(radio, ONE_ROOM_M))
    worlds = [random_world(radio, WorldSettings(people=(1, 1)), 0, k, place) for k in range(2)]
    assert all(world.devices == place.devices for world in worlds)
    assert all((world.setting.bounds_m == place.bounds_m).all() for world in worlds)
    one, other = (world.joints(0.0) for world in worlds)
    assert np.abs(one - other).max() > 0.01
    assert len(worlds[0].setting.parts) != len(worlds[1].setting.parts) or not torch.equal(
        *(torch.from_numpy(world.setting.parts[-1].triangles) for world in worlds)
    )


def test_whole_recordings_are_taken_and_names_say_what_parts_depend_on() -> None:
    radio = preset("mmwave")
    assert Trial("points", radio, 100, 1.0, one_room=True).examples == 10
    assert Trial("points", radio, 1, 1.0, one_room=True).examples == 5
    assert Trial("points", radio, 100, 1.0, one_room=False).examples == 12
    assert Trial("amplitudes", preset("wifi"), 100, 1.0, one_room=True).examples == 80
    _, _, place = channel()
    here = Trial("amplitudes", preset("wifi"), 9, 1.0, one_room=False, place=place)
    moved = Place(place.bounds_m + 0.1, place.devices)
    there = Trial("amplitudes", preset("wifi"), 9, 1.0, one_room=False, place=moved)
    assert here.name != there.name


def test_devices_of_different_arrays_are_refused() -> None:
    static, _, place = channel()
    elements = layout(few_antennas(preset("wifi")), place.devices)
    rx_xyz = elements.rx_xyz.copy()
    rx_xyz[0] += 0.01
    with pytest.raises(RfgsError, match="rows and columns"):
        pictures(static[None], static, replace(elements, rx_xyz=rx_xyz))
