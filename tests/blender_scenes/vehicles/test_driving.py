# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

import numpy as np
import pytest

from blender_scenes.vehicles.driving import Chassis, Route, distances, drive

CAR = Chassis(
    wheels_m={"fl": (2.5, 0.7), "fr": (2.5, -0.7), "rl": (0.0, 0.7), "rr": (0.0, -0.7)},
    radius_m=dict.fromkeys(("fl", "fr", "rl", "rr"), 0.3),
)
TRUCK = Chassis(
    wheels_m={"fl": (0.0, 0.5), "fr": (0.0, -0.5), "rl": (-1.4, 0.4), "rr": (-1.4, -0.4)},
    radius_m={"fl": 0.31, "fr": 0.31, "rl": 0.24, "rr": 0.24},
)
LEFT = Route((1.0, -2.0), 0.3, ((1.0, 0.0), (5.0, math.pi / 3), (1.0, 0.0)))
STEADY = ((0.0, 1.0), (100.0, 1.0))


def hub_path(motion, offset: tuple[float, float]) -> np.ndarray:
    """Places of a hub from above, from nothing but place and heading; shape (frame, 2)."""
    turn = motion.turn_rad[:, 2]
    ahead = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    aside = np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    return motion.place_m[:, :2] + offset[0] * ahead + offset[1] * aside


def test_wheels_turn_by_distance_over_radius_on_a_straight_line() -> None:
    straight = Route((0.0, 0.0), 0.0, ((10.0, 0.0),))
    motion = drive(straight, CAR, 31, 10, ((0.0, 2.0), (3.0, 1.0)))
    for spin in motion.spin_rad.values():
        assert spin[-1] == pytest.approx(4.5 / 0.3, rel=1e-6)
    assert max(np.abs(steer).max() for steer in motion.steer_rad.values()) == 0.0
    assert motion.place_m[-1] == pytest.approx([4.5, 0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("chassis", [CAR, TRUCK], ids=["front steered", "rear steered"])
def test_every_wheel_rolls_its_own_way_without_slipping(chassis: Chassis) -> None:
    # Chords at 2,000 frames per second: 0.5 mm each.
    motion = drive(LEFT, chassis, 13_001, 2000, STEADY)
    for name, offset in chassis.wheels_m.items():
        steps = np.diff(hub_path(motion, offset), axis=0)
        rolled = np.linalg.norm(steps, axis=1).sum() / chassis.radius_m[name]
        assert motion.spin_rad[name][-1] == pytest.approx(rolled, rel=1e-4), name
        course = np.arctan2(steps[:, 1], steps[:, 0])
        wheel = motion.turn_rad[:, 2] + motion.steer_rad[name]
        slip = np.angle(np.exp(1j * (course - 0.5 * (wheel[1:] + wheel[:-1]))))
        assert np.abs(slip).max() < 2e-3, name


def test_wheels_steer_into_the_bend_and_the_inner_one_more() -> None:
    ahead, behind = drive(LEFT, CAR, 71, 10, STEADY), drive(LEFT, TRUCK, 71, 10, STEADY)
    middle = 35
    assert ahead.steer_rad["fl"][middle] > ahead.steer_rad["fr"][middle] > 0.2
    assert behind.steer_rad["rl"][middle] < behind.steer_rad["rr"][middle] < -0.1
    assert ahead.steer_rad["rl"][middle] == behind.steer_rad["fl"][middle] == 0.0
    assert ahead.spin_rad["fr"][-1] > ahead.spin_rad["fl"][-1]


def test_route_turns_as_asked_without_jumps() -> None:
    assert LEFT.length_m == pytest.approx(7.0)
    assert LEFT.heading(np.array([0.0, 7.0])) == pytest.approx([0.3, 0.3 + math.pi / 3])
    s = np.linspace(0.0, 7.0, 701)
    assert np.abs(np.diff(LEFT.curvature(s))).max() < 0.01
    steps = np.linalg.norm(np.diff(LEFT.position(s), axis=0), axis=1)
    assert steps == pytest.approx(0.01, rel=1e-3)


def test_distance_is_the_integral_of_speed() -> None:
    knots = ((0.0, 2.0), (1.0, 1.0), (3.0, 0.0), (9.0, 0.0))
    times = np.linspace(0.0, 5.0, 501)
    speed = np.interp(times, *zip(*knots, strict=True))
    exact = np.concatenate([[0.0], np.cumsum(0.005 * (speed[1:] + speed[:-1]))])
    assert distances(times, knots) == pytest.approx(exact, abs=1e-9)


def test_wheels_touch_uneven_ground_and_do_not_enter_it() -> None:
    def bump(places: np.ndarray) -> np.ndarray:
        return 0.05 * np.exp(-(((places[..., 0] - 3.0) / 0.2) ** 2))

    straight = Route((0.0, 0.0), 0.0, ((10.0, 0.0),))
    motion = drive(straight, CAR, 41, 10, STEADY, bump)
    for name, (x, y) in CAR.wheels_m.items():
        roll, pitch, _ = motion.turn_rad.T
        plane = motion.place_m[:, 2] + roll * y - pitch * x
        hub = plane + CAR.radius_m[name] + motion.lift_m[name]
        along = np.linspace(-0.2999, 0.2999, 4001)
        disc = hub[:, None] - np.sqrt(0.09 - along**2)
        below = hub_path(motion, (x, y))[:, None, 0] + along
        gap = (disc - bump(np.stack([below, np.zeros_like(below)], axis=-1))).min(axis=1)
        assert np.abs(gap).max() < 1e-3, name
    # Nose up while the front axle is on the bump, nose down while the rear one is.
    assert motion.turn_rad[:, 1].min() < -0.01
    assert motion.turn_rad[30, 1] > 0.01
