# SPDX-License-Identifier: GPL-3.0-or-later
"""A forklift truck; its driven front axle stands at the origin, the rear wheels steer."""

from __future__ import annotations

from blender_scenes.shapes import Builder
from blender_scenes.vehicles.cars import Model
from blender_scenes.vehicles.driving import Chassis
from blender_scenes.vehicles.wheels import solid_wheel

#: Upper side of the forks above the ground when they are down [m].
FORK_M = 0.14
#: Where the middle of a pallet on the forks is [m].
LOAD_X_M = 1.18

_CHASSIS = Chassis(
    wheels_m={
        "front_left": (0.0, 0.46),
        "front_right": (0.0, -0.46),
        "rear_left": (-1.38, 0.40),
        "rear_right": (-1.38, -0.40),
    },
    radius_m={"front_left": 0.31, "front_right": 0.31, "rear_left": 0.24, "rear_right": 0.24},
)


def forklift_model() -> Model:
    """The truck without its carriage, which goes up and down (`carriage`)."""
    widths = {name: 0.20 if name.startswith("front") else 0.16 for name in _CHASSIS.wheels_m}
    return Model(truck, _CHASSIS, widths, 24.0, solid_wheel)


def truck(name: str) -> Builder:
    """Chassis, counterweight, seat, cage and mast."""
    made = Builder(name)
    paint, grey = "machine_yellow", "machine_grey"
    made.box((1.30, 0.66, 0.34), (-0.55, 0, 0.44), grey, bevel=0.03)
    made.box((0.62, 0.98, 0.62), (-1.52, 0, 0.80), paint, bevel=0.10, segments=3)
    made.box((0.52, 0.80, 0.30), (-1.50, 0, 0.42), grey, bevel=0.06, segments=2)
    made.box((0.74, 0.90, 0.36), (-0.88, 0, 0.79), paint, bevel=0.06, segments=2)
    made.box((0.50, 0.86, 0.10), (-0.25, 0, 0.46), grey, bevel=0.02)
    made.box((0.16, 0.92, 0.52), (0.10, 0, 0.78), paint, bevel=0.04, segments=2)
    for y in (-0.50, 0.50):
        made.box((0.72, 0.14, 0.05), (0.0, y, 0.70), paint, bevel=0.02)
        made.box((0.44, 0.12, 0.05), (-0.42, y * 0.9, 0.30), grey, bevel=0.015)
    _cockpit(made)
    _cage(made, paint)
    _mast(made)
    return made


def _cockpit(made: Builder) -> None:
    made.box((0.46, 0.48, 0.12), (-0.72, 0, 1.03), "seat_vinyl", bevel=0.04, segments=2)
    made.box(
        (0.11, 0.46, 0.52),
        (-0.98, 0, 1.30),
        "seat_vinyl",
        bevel=0.04,
        segments=2,
        tilt=(0, -0.16, 0),
    )
    made.rod((0.05, 0, 0.95), (-0.20, 0, 1.22), 0.022, "black_metal")
    for start, end in (
        ((-0.36, 0), (-0.20, 0.15)),
        ((-0.20, 0.15), (-0.04, 0)),
        ((-0.04, 0), (-0.20, -0.15)),
        ((-0.20, -0.15), (-0.36, 0)),
    ):
        made.rod(
            (*start, 1.24 - 0.5 * start[0] - 0.1),
            (*end, 1.24 - 0.5 * end[0] - 0.1),
            0.016,
            "black_metal",
        )


def _cage(made: Builder, paint: str) -> None:
    for y in (-0.44, 0.44):
        made.rod((0.12, y, 0.95), (-0.12, y, 2.10), 0.030, "black_metal")
        made.rod((-1.42, y, 1.05), (-1.28, y, 2.10), 0.030, "black_metal")
        made.rod((-0.10, y, 2.11), (-1.30, y, 2.11), 0.030, "black_metal")
    for index in range(7):
        x = -0.12 - 1.16 * index / 6
        made.rod((x, -0.44, 2.11), (x, 0.44, 2.11), 0.018, "black_metal")
    for y in (-0.34, 0.34):
        made.box((0.07, 0.13, 0.13), (-0.03, y, 1.98), "headlight", bevel=0.02)
        made.box((0.05, 0.12, 0.08), (-1.845, y, 0.96), "tail_lamp", bevel=0.015)
    made.lathe(
        [(0.06, 2.14), (0.065, 2.20), (0.05, 2.26), (0.02, 2.28)], (-1.1, 0, 0), "beacon", sides=12
    )
    made.box((0.03, 0.60, 0.12), (-1.845, 0, 0.80), paint, bevel=0.01)


def _mast(made: Builder) -> None:
    for y in (-0.34, 0.34):
        made.box((0.09, 0.07, 2.05), (0.46, y, 1.12), "machine_grey", bevel=0.008)
        made.rod((0.38, y * 0.55, 0.20), (0.38, y * 0.55, 1.75), 0.03, "fork_steel")
        made.rod((0.10, y, 0.62), (0.40, y, 0.95), 0.03, "fork_steel")
    for z in (0.16, 1.25, 2.12):
        made.box((0.07, 0.66, 0.08), (0.44, 0, z), "machine_grey", bevel=0.008)


def carriage(name: str) -> Builder:
    """Fork carriage, load guard and forks; z = 0 is the ground with the forks down."""
    made = Builder(name)
    for z in (0.24, 0.58):
        made.box((0.05, 0.92, 0.09), (0.555, 0, z), "fork_steel", bevel=0.008)
    for index in range(6):
        y = -0.42 + 0.168 * index
        made.rod((0.555, y, 0.62), (0.555, y, 1.15), 0.014, "black_metal")
    made.rod((0.555, -0.44, 1.16), (0.555, 0.44, 1.16), 0.020, "black_metal")
    for y in (-0.24, 0.24):
        made.box((0.05, 0.12, 0.55), (0.61, y, 0.385), "fork_steel", bevel=0.006)
        made.box((1.08, 0.12, 0.045), (1.15, y, FORK_M - 0.0225), "fork_steel", bevel=0.01)
    return made
