# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rfgs_core.radio.materials import MATERIALS

INNER = np.array([[-3.0, -2.5, 0.0], [3.0, 2.5, 2.7]])
WALK_RADIOS_HZ = ((5.72e9, 5.88e9), (60e9, 64e9))


def headings(walk: SimpleNamespace) -> np.ndarray:
    steps = np.gradient(walk.joints["root"][:, :2], axis=0)
    # Sway is averaged over a step of about eight frames.
    smooth = np.stack([np.convolve(axis, np.ones(15) / 15, "valid") for axis in steps.T], axis=1)
    return np.arctan2(smooth[:, 1], smooth[:, 0])


def furniture(walk: SimpleNamespace) -> dict[str, dict]:
    objects = walk.report["objects"]
    return {n: o for n, o in objects.items() if o["collection"] == "Furniture"}


def box_distance(points: np.ndarray, low: list[float], high: list[float]) -> np.ndarray:
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    return np.linalg.norm(outside, axis=-1)


def test_person_is_a_grown_up_who_stands_on_the_floor(walk: SimpleNamespace) -> None:
    height = walk.vertices[..., 2].max(axis=1) - walk.vertices[..., 2].min(axis=1)
    assert 1.6 < height.min() and height.max() < 1.85
    lowest = walk.vertices[..., 2].min(axis=1)
    assert lowest.min() > -0.01 and lowest.max() < 0.02
    assert walk.report["person"]["class"] == "PERSON"
    assert walk.report["action"] == "walk"


def test_skin_is_one_closed_triangle_mesh_of_moderate_size(walk: SimpleNamespace) -> None:
    faces = walk.faces
    assert faces.shape[1] == 3
    assert 5_000 < len(faces) < 10_000
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_stance_feet_do_not_slide(walk: SimpleNamespace) -> None:
    soles = 0
    for side in "LR":
        shoe = np.isin(walk.bone, [f"foot.{side}", f"toe1-1.{side}"])
        sole = shoe & (walk.vertices[..., 2].min(axis=0) < 0.012)
        points = walk.vertices[:, sole]
        down = points[..., 2] < 0.012
        # A vertex that touches the floor in two successive frames must not have moved.
        both = down[1:] & down[:-1]
        moved = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=2)
        # Five planted frames in a row: the sole lies flat, it is not only passing.
        planted = both.mean(axis=1) > 0.5
        assert planted.sum() >= 8
        assert moved[planted][both[planted]].max() < 0.005
        soles += planted.sum()
        ankle = walk.joints[f"foot.{side}"]
        still = np.linalg.norm(np.diff(ankle, axis=0), axis=1) < 0.001
        assert still.sum() >= 8
    assert soles > 20


def test_some_foot_always_carries_the_person(walk: SimpleNamespace) -> None:
    moved = np.stack(
        [np.linalg.norm(np.diff(walk.joints[f"toe1-1.{s}"], axis=0), axis=1) for s in "LR"]
    )
    # At heel strike the toes of the new foot still come down: up to two frames of 59 per step.
    assert (moved.min(axis=0) < 0.005).mean() > 0.9


def test_heading_follows_the_path(walk: SimpleNamespace) -> None:
    left, right = walk.joints["upperleg01.L"], walk.joints["upperleg01.R"]
    across = np.mean([right - left], axis=0)
    facing = np.unwrap(np.arctan2(across[:, 1], across[:, 0]) + np.pi / 2)
    smooth = np.convolve(facing, np.ones(15) / 15, "valid")
    error = np.angle(np.exp(1j * (smooth - headings(walk))))
    assert np.abs(error).max() < np.radians(6)
    assert np.ptp(headings(walk)) > np.radians(20)


def test_walk_is_two_and_a_half_to_four_metres_long(walk: SimpleNamespace) -> None:
    root = walk.joints["root"][:, :2]
    assert 2.5 < np.linalg.norm(root[-1] - root[0]) <= 4.0


def test_arms_swing_against_the_legs(walk: SimpleNamespace) -> None:
    forward = np.stack([walk.joints["upperleg01.R"] - walk.joints["upperleg01.L"]], axis=0)[0]
    forward = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    # Left minus right, along the direction of the walk.
    hands = walk.joints["wrist.L"] - walk.joints["wrist.R"]
    feet = walk.joints["foot.L"] - walk.joints["foot.R"]
    hands, feet = (np.einsum("ij,ij->i", v[:, :2], forward) for v in (hands, feet))
    assert np.corrcoef(hands, feet)[0, 1] < -0.8
    assert np.ptp(hands) > 0.25


def test_knees_do_not_bend_backwards(walk: SimpleNamespace) -> None:
    root = walk.joints["root"]
    travel = np.gradient(root[:, :2], axis=0)
    travel /= np.linalg.norm(travel, axis=1, keepdims=True)
    for side in "LR":
        hip, knee, ankle = (
            walk.joints[f"{b}.{side}"] for b in ("upperleg01", "lowerleg01", "foot")
        )
        ahead = np.einsum("ij,ij->i", (knee - 0.5 * (hip + ankle))[:, :2], travel)
        assert ahead.min() > -0.02


def test_person_keeps_clear_of_furniture_walls(walk: SimpleNamespace) -> None:
    points = walk.vertices[:, ::3].reshape(-1, 3)
    for name, item in furniture(walk).items():
        assert box_distance(points, item["low"], item["high"]).min() > 0.3, name
    edge = np.minimum(points[:, :2] - INNER[0, :2], INNER[1, :2] - points[:, :2])
    assert edge.min() > 0.6


def test_furniture_keeps_a_centimetre_from_floor_and_walls(walk: SimpleNamespace) -> None:
    for name, item in furniture(walk).items():
        low, high = np.array(item["low"]), np.array(item["high"])
        assert low[2] > 0.01 and high[2] < 2.69, name
        assert (high[:2] < INNER[1, :2] - 0.01).all(), name
        reaches = low[:2] - INNER[0, :2]
        # The door's handle goes to the recessed leaf of the door and stops short of that.
        assert (reaches > (-0.03 if name == "door_handle" else 0.01)).all(), name


def test_static_scene_is_small(walk: SimpleNamespace) -> None:
    assert sum(item["triangles"] for item in walk.report["objects"].values()) < 15_000


def test_walls_are_single_sheets_that_look_inwards(walk: SimpleNamespace) -> None:
    planes = np.array([p for o in walk.report["objects"].values() for p in o["planes"]])
    normals, centres = planes[:, :3], planes[:, 3:]
    inside = np.einsum("ij,ij->i", normals, np.array([0.0, 0.0, 1.3]) - centres)
    large = np.abs(normals).max(axis=1) > 0.999
    assert large.all()
    for axis in range(3):
        for sign in (-1, 1):
            facing = normals[:, axis] * sign > 0.5
            depth = np.unique(np.round(centres[facing, axis], 4))
            # No two parallel sheets within a centimetre of each other.
            assert (np.diff(depth) > 0.01).all()
    main = np.abs(np.abs(centres) - np.array([3.0, 2.5, 2.7])).min(axis=1) < 1e-3
    assert (inside[main] > 0).all()


def test_materials_are_valid_at_wifi_and_mmwave(walk: SimpleNamespace) -> None:
    kinds = set()
    for name, (kind, thickness_m) in walk.report["materials"].items():
        assert kind in MATERIALS, f"{name} has no radio material"
        assert 0.0005 < thickness_m < 0.5, name
        for low_hz, high_hz in WALK_RADIOS_HZ:
            assert MATERIALS[kind].freq_min_hz <= low_hz, name
            assert high_hz <= MATERIALS[kind].freq_max_hz, name
        kinds.add(kind)
    assert {"concrete", "plasterboard", "wood", "glass", "metal", "skin"} <= kinds


def test_access_points_stand_in_the_corners_looking_inwards(walk: SimpleNamespace) -> None:
    devices = walk.report["devices"]
    assert len(devices) == 4
    for device in devices.values():
        assert (device["role"], device["radio"]) == ("ACCESS_POINT", "any")
        x, y, z = device["position"]
        assert (abs(x), abs(y)) == pytest.approx((2.8, 2.3), abs=1e-5)
        assert z == pytest.approx(1.2, abs=1e-5) or z == pytest.approx(2.2, abs=1e-5)
        towards = -np.array([x, y]) / np.hypot(x, y)
        assert np.array(device["boresight"][:2]) @ towards == pytest.approx(1.0, abs=1e-5)
        assert device["up"] == pytest.approx([0, 0, 1], abs=1e-6)
        for name, item in furniture(walk).items():
            gap = box_distance(np.array([x, y, z]), item["low"], item["high"])
            assert gap > 0.15, name


def test_cameras_see_the_person_in_every_frame(walk: SimpleNamespace) -> None:
    assert walk.report["cameras"][:12] == [f"cam_{index:02d}" for index in range(12)]
    for index, camera in enumerate(walk.cameras):
        eye = camera[:3, 3]
        assert ((eye > INNER[0] + 0.05) & (eye < INNER[1] - 0.05)).all()
        for name, item in furniture(walk).items():
            assert box_distance(eye, item["low"], item["high"]) > 0.05, name
        local = (walk.vertices - eye) @ camera[:3, :3]
        assert (local[..., 2] < -0.4).all()
        slopes = np.abs(local[..., :2] / local[..., 2:])
        assert slopes.max() < np.tan(walk.angles[index] / 2)
        # Hardly anything stands before the person: 17 of 18 joints at any time, all in the mean.
        assert walk.seen[:, index].mean(axis=1).min() > 0.8, index
        assert walk.seen[:, index].mean() > 0.98, index


def test_rendering_is_plain(walk: SimpleNamespace) -> None:
    assert walk.report["engine"] == "CYCLES"
    assert walk.report["view_transform"] == "Standard"
