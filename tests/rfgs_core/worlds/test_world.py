# SPDX-License-Identifier: Apache-2.0
"""Whole random worlds: everybody has room, beds are under sleepers, channels tell of people."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio.presets import preset
from rfgs_core.worlds.cast import segment_centres
from rfgs_core.worlds.furniture import Mesh
from rfgs_core.worlds.world import World, WorldSettings, random_world, soundings

SETTINGS = WorldSettings(frames=3, people=(1, 3))


@pytest.fixture(scope="module")
def worlds() -> list[World]:
    """Worlds of two radios."""
    return [random_world(preset(n), SETTINGS, 4, i) for n in ("wifi", "mmwave") for i in range(12)]


def test_number_and_seed_are_a_world() -> None:
    one, again = (random_world(preset("wifi"), SETTINGS, 4, 7) for _ in range(2))
    np.testing.assert_array_equal(one.vertices(0.2), again.vertices(0.2))
    np.testing.assert_array_equal(one.setting.mesh()[0], again.setting.mesh()[0])
    assert one.devices == again.devices
    for seed, index in ((4, 8), (5, 7)):
        other = random_world(preset("wifi"), SETTINGS, seed, index)
        assert not np.array_equal(one.setting.bounds_m, other.setting.bounds_m)


def test_rooms_too_small_for_arrays_along_their_walls_are_drawn_anew() -> None:
    settings = WorldSettings(frames=1, people=(1, 1))
    radio = preset("uwb")
    inset_m, array_m = 0.1, 3.0
    for index in range(12):
        world = random_world(radio, settings, 3133, index)
        sides_m = np.diff(world.setting.bounds_m[:, :2], axis=0)[0] - 2 * inset_m
        assert 2 * (sides_m // array_m).sum() >= len(world.devices) == radio.num_devices


def test_people_stay_within_their_room_and_out_of_all_that_stands_there(worlds) -> None:
    beds = 0
    for world in worlds:
        low, high = world.setting.bounds_m
        beds += sum(part.name.startswith("bed") for part in world.setting.parts)
        for time_s in (0.0, 0.25):
            skin = world.vertices(time_s)
            assert (skin > low - 0.02).all() and (skin < high).all()
            for part in world.setting.parts[6:]:
                # Toes brush the edges of treads.
                allowed_m = 0.02 if part.name.startswith("stairs") else 0.0
                assert deepest_m(skin, part) <= allowed_m + 1e-6, part.name
    assert beds, "somebody lies on a bed"


def deepest_m(skin: np.ndarray, part: Mesh) -> float:
    """How deep the skin is in a box, which may be turned [m]; below 0 where it is outside."""
    centre = part.triangles.reshape(-1, 3).mean(axis=0)
    depth = np.full(len(skin), np.inf)
    for a, b, c in part.triangles:
        normal = np.cross(b - a, c - a)
        normal *= np.sign(normal @ (a - centre)) / np.linalg.norm(normal)
        depth = np.minimum(depth, (a - skin) @ normal)
    return float(depth.max())


@pytest.mark.parametrize(("family", "name"), [("sit", "chair"), ("stairs", "stairs")])
def test_chairs_and_stairs_are_where_motions_need_them(family: str, name: str) -> None:
    settings = WorldSettings(frames=8, people=(1, 1), families=(family,))
    for index in range(5):
        world = random_world(preset("wifi"), settings, 2, index)
        low, high = world.setting.bounds_m
        boards = [part for part in world.setting.parts if part.name.startswith(name)]
        corners = np.concatenate([board.triangles.reshape(-1, 3) for board in boards])
        assert (corners > low - 1e-9).all() and (corners < high).all()
        (actor,) = world.actors
        gaps_m = []
        # Also before the world begins and after it ends: a chair is there as somebody sits down.
        for time_s in np.arange(-actor.start_s, actor.motion.duration_s - actor.start_s, 0.1):
            skin = world.vertices(float(time_s))
            deepest = max(deepest_m(skin, board) for board in boards)
            assert deepest <= (0.02 + 1e-6 if family == "stairs" else 0.0)
            lowest = float(skin[:, 2].min())
            gaps_m.append([gap_m(skin, board) for board in boards] + [lowest])
        nearest = np.min(gaps_m, axis=1)
        assert (nearest < 0.04).all(), "something bears the person at every instant"
        seat = np.min(gaps_m, axis=0)[0]
        assert seat < 0.04, "the seat, and the first tread, are used"


def gap_m(skin: np.ndarray, board: Mesh) -> float:
    """How far the lowest skin over a level board is above it [m]; infinite where there is none."""
    corners = board.triangles.reshape(-1, 3)
    centre, top = corners.mean(axis=0), corners[:, 2].max()
    edges = board.triangles[:, [0, 1]] - board.triangles[:, [1, 2]]
    flat = edges[np.abs(edges[..., 2]) < 1e-9].reshape(-1, 3)
    inside = np.ones(len(skin), dtype=bool)
    for edge in flat:
        way = edge / np.linalg.norm(edge)
        inside &= np.abs((skin - centre) @ way) <= np.abs((corners - centre) @ way).max() + 1e-9
    over = inside & (skin[:, 2] > top - 0.03)
    return float(skin[over, 2].min(initial=np.inf) - top)


def test_those_who_walk_down_begin_on_top_and_end_on_the_floor() -> None:
    settings = WorldSettings(frames=2, people=(1, 1), families=("stairs",))
    worlds = [random_world(preset("wifi"), settings, 5, index) for index in range(8)]
    lifted = [world.actors[0] for world in worlds if world.actors[0].lift_m > 0.0]
    assert lifted and len(lifted) < len(worlds)
    for actor in lifted:
        ends = actor.body.skin(actor.pose(actor.motion.duration_s))[:, 2].min()
        assert abs(ends) < 0.03
        begins = actor.body.skin(actor.pose(-actor.start_s))[:, 2].min()
        assert begins == pytest.approx(actor.lift_m, abs=0.03)


def test_devices_stand_in_the_room_and_out_of_furniture(worlds) -> None:
    counts = set()
    for world in worlds:
        low, high = world.setting.bounds_m
        counts.add(len(world.devices))
        for device in world.devices:
            place = np.array(device.position_m)
            assert (place > low).all() and (place < high).all() and place[2] <= 2.4 + 1e-9
            for part in world.setting.parts[6:]:
                corners = part.triangles.reshape(-1, 3)
                assert not ((place > corners.min(axis=0)) & (place < corners.max(axis=0))).all()
    assert {3, 6} <= counts


def test_segments_move_with_their_joints(worlds) -> None:
    actor, segment = worlds[0].actors[0], worlds[0].segment[0]
    joints = actor.body.joints17(actor.pose(0.1))
    centres = segment_centres(actor, segment, 0.1)
    assert np.linalg.norm(centres - joints, axis=1).max() < 0.35
    still, moved = worlds[0].joints(0.1)[0], worlds[0].joints(0.2)[0]
    speed = worlds[0].segment_velocity(0.15, 0.1)[0]
    np.testing.assert_allclose(speed[0], (moved - still)[0] / 0.1, atol=0.15)


def test_where_a_motion_begins_or_ends_velocity_is_that_of_the_half_that_there_is(worlds) -> None:
    actor = worlds[0].actors[0]
    lasts_s = actor.motion.duration_s
    for start_s, ends_s in ((0.0, (0.0, 0.05)), (lasts_s, (-0.05, 0.0)), (lasts_s + 1.0, None)):
        there = replace(actor, start_s=start_s)
        world = replace(worlds[0], actors=[there])
        found = world.segment_velocity(0.0, 0.1)[0]
        if ends_s is None:
            assert not found.any()
            continue
        before, after = (segment_centres(there, world.segment[0], at_s) for at_s in ends_s)
        np.testing.assert_allclose(found, (after - before) / 0.05, atol=1e-4)


def test_a_stream_hears_people_and_its_workers_share_it() -> None:
    settings = WorldSettings(frames=1, depth=1)
    every = list(islice(soundings(preset("wifi_commodity"), settings, seed=1), 2))
    (second,) = islice(soundings(preset("wifi_commodity"), settings, seed=1, first=1, step=2), 1)
    np.testing.assert_array_equal(every[1].csi, second.csi)
    for heard in every:
        links = heard.csi_static.shape
        assert heard.csi.shape == (1, *links) and np.isfinite(heard.csi).all()
        change = np.abs(heard.csi[0] - heard.csi_static) ** 2
        share = change.sum() / (np.abs(heard.csi_static) ** 2).sum()
        assert 1e-7 < share < 1.0


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (WorldSettings(people=(2, 1)), "people 2:1"),
        (WorldSettings(people=(1, 9)), "people 1:9"),
        (WorldSettings(frames=0), "frames 0"),
        (WorldSettings(fps=float("nan")), "fps nan"),
        (WorldSettings(depth=4), "depth 4"),
        (WorldSettings(families=("fly",)), "motion 'fly'"),
    ],
)
def test_worlds_that_cannot_be_are_refused(settings: WorldSettings, said: str) -> None:
    with pytest.raises(RfgsError, match=said):
        random_world(preset("wifi"), settings, 0, 0)


def test_radios_that_move_or_fit_no_room_are_refused() -> None:
    with pytest.raises(RfgsError, match="antennas move"):
        random_world(preset("sar"), SETTINGS, 0, 0)
    from dataclasses import replace

    coarse = replace(preset("mmwave"), num_subcarriers=16)
    with pytest.raises(RfgsError, match="more subcarriers"):
        random_world(coarse, SETTINGS, 0, 0)
