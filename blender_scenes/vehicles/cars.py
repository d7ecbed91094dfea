# SPDX-License-Identifier: GPL-3.0-or-later
"""A small car and a delivery van; the rear axle stands at the origin, ahead is +x."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from blender_scenes.shapes import Builder
from blender_scenes.vehicles.bodywork import (
    DOOR,
    FLOOR,
    SILL,
    WINDOW,
    EndPaint,
    Shape,
    add_body,
    pane_paint,
)
from blender_scenes.vehicles.driving import Chassis
from blender_scenes.vehicles.wheels import wheel

#: How to build a wheel: name, radius [m], width [m]; `outer` is 1 on the left, −1 on the right.
WheelBuilder = Callable[..., Builder]


@dataclass(frozen=True)
class Model:
    """A kind of vehicle."""

    body: Callable[[str], Builder]
    """Builds everything but the wheels."""
    chassis: Chassis
    """Where the wheels are."""
    tyre_m: dict[str, float]
    """Width of each wheel [m]."""
    surface_m2: float
    """Nominal outer surface [m²]."""
    wheel: WheelBuilder = wheel
    """Builds a wheel."""


def _axles(wheelbase_m: float, track_m: float, radius_m: float) -> Chassis:
    half = track_m / 2
    wheels = {
        "front_left": (wheelbase_m, half),
        "front_right": (wheelbase_m, -half),
        "rear_left": (0.0, half),
        "rear_right": (0.0, -half),
    }
    return Chassis(wheels, dict.fromkeys(wheels, radius_m))


_CAR_RADIUS_M, _CAR_BASE_M = 0.31, 2.46
_CAR = Shape(
    bottom=((-0.70, 0.30), (-0.55, 0.23), (2.95, 0.21), (3.20, 0.26)),
    belt=((-0.70, 0.84), (-0.55, 0.92), (0.6, 0.90), (2.0, 0.87), (2.75, 0.82), (3.20, 0.68)),
    top=(
        (-0.70, 0.92), (-0.62, 1.02), (-0.26, 1.38), (0.0, 1.44), (0.55, 1.475), (1.05, 1.455),
        (1.30, 1.40), (2.02, 0.985), (2.55, 0.945), (2.95, 0.88), (3.12, 0.81), (3.20, 0.72),
    ),
    half_belt=(
        (-0.70, 0.66), (-0.60, 0.77), (-0.2, 0.83), (1.2, 0.855), (2.4, 0.835), (2.9, 0.78),
        (3.10, 0.71), (3.20, 0.62),
    ),
    half_top=(
        (-0.70, 0.56), (-0.26, 0.56), (0.55, 0.585), (1.30, 0.57), (2.02, 0.70), (2.9, 0.64),
        (3.20, 0.50),
    ),
    crown_m=0.045, axles=(0.0, _CAR_BASE_M), arch_m=0.355, hub_m=_CAR_RADIUS_M,
    side_panes=((-0.26, -0.02), (0.05, 0.72), (0.80, 1.68)),
    sloping_panes=((-0.60, -0.28), (1.33, 1.98)),
)  # fmt: skip


def car(name: str, paint: str, *, lit: bool = False) -> Builder:
    """Body of a five-door hatchback, 3.9 m long; `lit` switches its lamps on."""
    made = Builder(name)
    head, tail = _lamps(lit)

    def panels(band: int, x0: float, x1: float) -> str:
        if band == FLOOR:
            return "underbody"
        if band == SILL and (x1 < -0.5 or x0 > 2.9):
            return "plastic_black"
        if band == DOOR and x0 > 3.05:
            return head
        if band == DOOR and x1 < -0.59:
            return tail
        return paint

    front = _ends(paint, head, "plastic_black")
    rear = _ends(paint, tail, paint)
    add_body(made, _CAR, pane_paint(_CAR, "car_glass", panels), rear, front)
    _plates(made, 3.20, -0.70, 0.42)
    for side in (-1, 1):
        made.box((0.13, 0.17, 0.11), (1.72, side * 0.93, 0.95), paint, bevel=0.03, segments=2)
        for x in (0.72, -0.02):
            made.box(
                (0.17, 0.03, 0.03), (x + 0.05, side * 0.855, 0.80), "plastic_black", bevel=0.01
            )
    return made


_VAN_RADIUS_M, _VAN_BASE_M = 0.34, 3.0
_VAN = Shape(
    bottom=((-0.95, 0.36), (-0.80, 0.30), (3.35, 0.28), (3.62, 0.34)),
    belt=((-0.95, 1.10), (-0.80, 1.14), (2.4, 1.14), (2.9, 1.05), (3.3, 0.99), (3.62, 0.86)),
    top=(
        (-0.95, 1.98), (-0.90, 2.06), (-0.6, 2.12), (0.8, 2.14), (1.85, 2.11), (2.15, 2.02),
        (2.92, 1.22), (3.25, 1.13), (3.50, 1.03), (3.62, 0.91),
    ),
    half_belt=((-0.95, 0.90), (-0.85, 0.94), (2.3, 0.95), (2.95, 0.92), (3.35, 0.87), (3.62, 0.74)),
    half_top=(
        (-0.95, 0.80), (-0.85, 0.82), (1.9, 0.82), (2.15, 0.79), (2.92, 0.80), (3.3, 0.72),
        (3.62, 0.52),
    ),
    crown_m=0.05, axles=(0.0, _VAN_BASE_M), arch_m=0.40, hub_m=_VAN_RADIUS_M,
    side_panes=((1.62, 2.62),), sloping_panes=((2.18, 2.88),),
)  # fmt: skip


def van(name: str, paint: str, stripe: str, *, lit: bool = False) -> Builder:
    """Body of a delivery van with a high roof, 4.6 m long."""
    made = Builder(name)
    head, tail = _lamps(lit)

    def panels(band: int, x0: float, x1: float) -> str:
        if band == FLOOR:
            return "underbody"
        if band == SILL and (x1 < -0.7 or x0 > 3.3):
            return "plastic_black"
        if band == DOOR:
            return head if x0 > 3.45 else tail if x1 < -0.79 else stripe
        return paint

    def rear(band: int, column: int) -> str:
        if band == WINDOW and column in (1, 3):
            return "car_glass"
        return _ends(paint, tail, paint)(band, column)

    front = _ends(paint, head, "plastic_black")
    add_body(made, _VAN, pane_paint(_VAN, "car_glass", panels), rear, front)
    _plates(made, 3.62, -0.95, 0.52)
    made.box((0.05, 1.5, 0.10), (-0.985, 0.0, 0.42), "plastic_black", bevel=0.02)
    for side in (-1, 1):
        made.box(
            (0.14, 0.18, 0.26), (2.50, side * 1.06, 1.30), "plastic_black", bevel=0.03, segments=2
        )
        made.box((1.9, 0.03, 0.04), (0.45, side * 0.965, 1.13), "plastic_black", bevel=0.01)
        made.box((0.18, 0.03, 0.03), (1.72, side * 0.962, 1.02), "plastic_black", bevel=0.01)
    return made


def car_model(paint: str, *, lit: bool = True) -> Model:
    """The car, as it drives."""
    chassis = _axles(_CAR_BASE_M, 1.46, _CAR_RADIUS_M)
    widths = dict.fromkeys(chassis.wheels_m, 0.19)
    return Model(lambda name: car(name, paint, lit=lit), chassis, widths, 26.0)


def van_model(paint: str, stripe: str, *, lit: bool = True) -> Model:
    """The van, as it drives."""
    chassis = _axles(_VAN_BASE_M, 1.62, _VAN_RADIUS_M)
    widths = dict.fromkeys(chassis.wheels_m, 0.21)
    return Model(lambda name: van(name, paint, stripe, lit=lit), chassis, widths, 42.0)


def _lamps(lit: bool) -> tuple[str, str]:
    return ("headlight", "tail_lamp") if lit else ("headlight_off", "tail_lamp_off")


def _ends(paint: str, lamp: str, grille: str) -> EndPaint:
    """Lamps outside, grille between them, bumper below."""

    def end(band: int, column: int) -> str:
        if band in (FLOOR, SILL):
            return "plastic_black"
        if band == DOOR:
            return lamp if column in (0, 4) else grille
        return paint

    return end


def _plates(made: Builder, front_m: float, rear_m: float, height_m: float) -> None:
    for x in (front_m + 0.013, rear_m - 0.013):
        made.box((0.03, 0.46, 0.10), (x, 0.0, height_m), "plate_white", bevel=0.006)
