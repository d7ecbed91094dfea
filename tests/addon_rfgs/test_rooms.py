# SPDX-License-Identifier: Apache-2.0
"""Antennas stand in the room around the people, whatever the bounds of the scene are."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.devices import choose_devices, scene_problems
from dataset_factory.scene.outline import left_out
from rfgs_core.radio import DevicePose, place_devices, preset

HERE = Path(__file__).parent
FLOOR_M, CEILINGS_M = 0.0, {"low": 2.1, "cloth": 2.6, "scarf": 2.6, "ell": 2.6, "flat": 2.6}


@pytest.fixture(scope="module")
def rooms(python, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rooms")
    python(HERE / "build_rooms.py", folder, must_work=True)
    return folder


def places(devices: list[DevicePose]) -> np.ndarray:
    return np.array([device.position_m for device in devices])


def by_bounds(bundle: Bundle, radio: str) -> np.ndarray:
    """Where the rule alone puts the devices, as it did before rooms counted."""
    return places(place_devices(preset(radio), bundle.bounds_m))


@pytest.mark.parametrize("name", CEILINGS_M)
def test_the_room_is_what_people_have_around_them(rooms: Path, name: str) -> None:
    room = read_bundle(rooms / name).room
    assert room is not None
    low, high = {
        "low": ([-2, -2.5], [2, 2.5]),
        "cloth": ([-2.5, -2], [2.5, 2]),
        "scarf": ([-2.5, -2], [2.5, 2]),
        "ell": ([-3, -3], [3, 3]),
        "flat": ([-2.5, -2], [2.5, 2]),
    }[name]
    np.testing.assert_allclose(room.box_m, [[*low, 0], [*high, CEILINGS_M[name]]], atol=1e-3)
    assert (room.seen_m >= room.box_m[0] - 1e-3).all()
    assert (room.seen_m <= room.box_m[1] + 1e-3).all()


@pytest.mark.parametrize("name", CEILINGS_M)
@pytest.mark.parametrize("radio", ["wifi", "uwb"])
def test_antennas_are_inside(rooms: Path, name: str, radio: str) -> None:
    bundle = read_bundle(rooms / name)
    devices, guess = choose_devices(bundle, preset(radio))
    found = places(devices)
    assert guess is not None and len(found) == len(by_bounds(bundle, radio))
    assert (found[:, 2] > FLOOR_M + 0.5).all()
    assert (found[:, 2] < CEILINGS_M[name] - 0.1).all(), "below the ceiling"
    if name == "ell":
        assert not ((found[:, 0] > 0.9) & (found[:, 1] > 0.9)).any(), "not in the notch"
    if name == "flat":
        assert (found[:, 0] < 2.5).all(), "not next door"
    assert scene_problems(bundle, {radio: devices}, [preset(radio)]) == []


def test_bounds_alone_would_put_them_outside(rooms: Path) -> None:
    low, cloth = (by_bounds(read_bundle(rooms / name), "wifi") for name in ("low", "cloth"))
    assert low[:, 2].max() > 2.1 and (cloth[:, 2] < 0.0).all()


@pytest.mark.parametrize("name", ["cloth", "scarf"])
def test_heights_are_above_the_floor_under_the_people(rooms: Path, name: str) -> None:
    """Above what fell 0.9 m below it, some would stand on the floor and none would be outside."""
    bundle = read_bundle(rooms / name)
    heights_m = [1.2, 2.2, 1.2, 2.2]
    low = 0.0 - bundle.bounds_m[0, 2]
    assert low > 0.8
    np.testing.assert_allclose(
        by_bounds(bundle, "wifi")[:, 2], np.subtract(heights_m, low), atol=1e-3
    )
    found = places(choose_devices(bundle, preset("wifi"))[0])
    np.testing.assert_allclose(found[:, 2], heights_m, atol=1e-3)


def test_the_guess_says_whether_the_room_or_the_scene_counted(rooms: Path) -> None:
    for name, where in (("low", "scene"), ("ell", "room that people are in")):
        _, guess = choose_devices(read_bundle(rooms / name), preset("wifi"))
        assert guess is not None and guess["value"] == f"4 in the corners of the {where}"


def test_devices_in_corners_come_around_what_hides_them(rooms: Path) -> None:
    bundle = read_bundle(rooms / "ell")
    before, (now, _) = by_bounds(bundle, "wifi"), choose_devices(bundle, preset("wifi"))
    moved = np.linalg.norm((places(now) - before)[:, :2], axis=1) > 1e-3
    assert moved.tolist() == [False, False, True, False]
    # On the line from its corner to the people, clear of the wall's edge, looking at them.
    x, y, _ = now[2].position_m
    assert 0.0 < x < 0.9 and 0.0 < y < 0.9 and np.hypot(0.9 - x, 0.9 - y) > 0.1
    w, _, _, z = now[2].quat_wxyz
    boresight = np.array([w * w - z * z, 2 * w * z])
    assert boresight @ (-np.array([x, y]) / np.hypot(x, y)) > 0.9


@pytest.mark.parametrize("name", CEILINGS_M)
@pytest.mark.parametrize("radio", ["wifi", "uwb"])
def test_blender_places_them_as_the_factory_does(rooms: Path, name: str, radio: str) -> None:
    theirs, _ = choose_devices(read_bundle(rooms / name), preset(radio))
    ours, guess = choose_devices(read_bundle(rooms / f"{name}_{radio}"), preset(radio))
    assert guess is None
    np.testing.assert_allclose(places(ours), places(theirs), atol=1e-3)


def test_a_circle_that_leaves_the_room_is_refused_in_one_line(rooms: Path) -> None:
    bundle, radio = read_bundle(rooms / "ell"), preset("sar")
    devices, _ = choose_devices(bundle, radio)
    (problem,) = scene_problems(bundle, {"sar": devices}, [radio])
    assert problem.startswith("radio 'sar': no place in the room around the people")
    assert "place devices in the scene" in problem and "\n" not in problem
    assert "no place in the room" in json.loads((rooms / "errors.json").read_text())["ell_sar"]


def test_one_s_own_devices_may_stand_elsewhere_and_are_told(rooms: Path, addon) -> None:
    out = rooms / "own.json"
    assert addon(rooms / "own.blend", "check", "--out", out).returncode == 0
    rows: list[dict[str, Any]] = json.loads(out.read_text())["findings"]
    told = {row["object"]: row["severity"] for row in rows if row["kind"] == "device_elsewhere"}
    assert told == {"cellar": "info"}


def test_without_anything_around_the_bounds_count(rooms: Path) -> None:
    bundle = replace(read_bundle(rooms / "low"), room=None)
    devices, _ = choose_devices(bundle, preset("wifi"))
    np.testing.assert_allclose(places(devices), by_bounds(bundle, "wifi"))


def test_what_takes_no_part_is_named() -> None:
    rows = [
        {"name": "tx", "radio": "scene", "role": "TRANSMITTER"},
        {"name": "ap", "radio": "any", "role": "ACCESS_POINT"},
        {"name": "lab", "radio": "lab", "role": "RECEIVER"},
        {"name": "mark", "radio": "scene", "role": "NONE"},
    ]
    wifi, uwb = preset("wifi"), preset("uwb")
    own, lab = left_out(rows, [wifi])
    assert own == "device 'tx' of radio 'scene' is left out of wifi; add --radio scene"
    assert "'lab'" in lab and lab.endswith("add --radio a file that describes it")
    assert left_out(rows[:2], [replace(wifi, name="scene")]) == []
    _, anyone, _ = left_out(rows, [uwb])
    assert anyone.startswith("device 'ap' of radio 'any' is left out of uwb; ")
