# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds parking_lot: a car turns into a bay in the evening sun while a customer walks by."""

from __future__ import annotations

import math
from itertools import pairwise

import bpy
import numpy as np

from blender_scenes.assemble import Folders, watch
from blender_scenes.motion.going import Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets.facades import Front, awning, build_front, glazing, sign
from blender_scenes.sets.lighting import soft_light, sun
from blender_scenes.sets.outdoors import (
    GAP_M,
    bollard,
    bush,
    for_the_eye,
    ground,
    lamp_post,
    paint,
    ticket_machine,
    tree,
    trolleys,
)
from blender_scenes.sets.shell import Wall
from blender_scenes.shapes import Builder
from blender_scenes.stage import add_access_points
from blender_scenes.vehicles.cars import car_model
from blender_scenes.vehicles.driving import Route, drive
from blender_scenes.vehicles.rig import build_vehicle, key_drive, park

#: Edges of the radio scene [m]; beyond them everything is for the eye only.
WEST_M, EAST_M, SOUTH_M, NORTH_M = -7.2, 7.2, -5.6, 6.2
#: From the lawn over the aisle and the bays to the pavement before the shop [m].
LAWN_M, AISLE_M, BAYS_M = -3.9, 0.2, 5.0
KERB_M = 0.12
HUMP_X_M, HUMP_HALF_M, HUMP_M = -2.3, 0.45, 0.05
BAY_RAD, BAY_STEP_M = math.radians(60), 2.5 / math.sin(math.radians(60))
#: Along the aisle over the hump, then left into the second bay from the east.
ROUTE = Route((-5.6, -1.9), 0.0, ((1.4, 0.0), (5.0, BAY_RAD), (1.3, 0.0)))
SPEEDS = ((0.0, 1.7), (1.5, 1.5), (4.6, 1.2), (6.3, 0.0), (10.0, 0.0))
CAMERAS = (
    (6.6, -5.5, 3.4), (-6.7, 5.2, 3.4), (-6.7, -5.5, 2.8), (6.7, 5.2, 2.3), (0.4, 5.9, 4.1),
    (-7.0, -1.0, 3.8), (7.1, -3.6, 2.0), (-3.6, 5.9, 4.1), (7.0, 0.6, 4.0), (3.8, 5.9, 3.8),
    (-7.0, -3.6, 1.8), (-7.0, 2.6, 3.6),
)  # fmt: skip


def hump(places: np.ndarray) -> np.ndarray:
    """Height of the aisle [m]: level but for one rounded hump across it; shape (..., 2) in."""
    off = np.clip((places[..., 0] - HUMP_X_M) / HUMP_HALF_M, -1.0, 1.0)
    inside = (places[..., 1] > LAWN_M) & (places[..., 1] < AISLE_M)
    return np.where(inside, 0.5 * HUMP_M * (1.0 + np.cos(np.pi * off)), 0.0)


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    _ground(folders["Room"])
    _shop(folders["Room"], folders["Furniture"])
    _surroundings(folders["Furniture"], folders["Room"])
    first = _bay(0)
    for name, bay, colour in (
        ("silver", -1, "car_silver"),
        ("green", -2, "car_green"),
        ("blue", 1, "car_blue"),
    ):
        place = (first[0] + bay * BAY_STEP_M, first[1], GAP_M)
        park(f"parked_{name}", car_model(colour, lit=False), place, BAY_RAD, folders["Furniture"])
    model = car_model("car_red")
    car = build_vehicle("car", model, folders["Person"])
    key_drive(car, drive(ROUTE, model.chassis, scene.frame_end, scene.render.fps, SPEEDS, hump))
    customer = cast(PEOPLE["hana"], folders["Person"])
    way = Walk([(2.4, -3.1), (-0.9, -2.5), (-2.2, -1.2)], 1.15, open_start=True, open_end=True)
    perform(customer, [way], Posture((6.0, -2.9), math.radians(183)), scene)
    places = [(6.5, -5.0, 3.0), (6.5, 5.7, 2.2), (-6.5, 5.7, 3.4), (-6.5, -5.0, 2.2)]
    add_access_points(places, (0.0, 0.0), folders["Stage"])
    watch(scene, CAMERAS, [customer.armature, car.root], folders["Stage"])
    _light(scene, folders["Stage"])


def _bay(index: int) -> tuple[float, float]:
    """Where the rear axle of a car in a bay stands; 0 is where the drive ends."""
    x, y = ROUTE.position(np.array(ROUTE.length_m)).tolist()
    return x + index * BAY_STEP_M, y


def _ground(room: bpy.types.Collection) -> None:
    ramp = np.linspace(HUMP_X_M - HUMP_HALF_M, HUMP_X_M + HUMP_HALF_M, 11).tolist()
    xs = [WEST_M, *ramp, EAST_M]
    stripes = np.linspace(LAWN_M, AISLE_M, 9).tolist()
    ys = [SOUTH_M, *stripes, BAYS_M, BAYS_M + 0.14, NORTH_M]

    def surface(x: float, y: float) -> str:
        if y < LAWN_M:
            return "lawn"
        if y > BAYS_M:
            return "kerb_stone" if y < BAYS_M + 0.14 else "paving"
        if LAWN_M < y < AISLE_M and abs(x - HUMP_X_M) < HUMP_HALF_M:
            stripe = sum(y > low for low in stripes)
            return "rubber_hump" if stripe % 2 else "line_yellow"
        return "asphalt"

    def height(x: float, y: float) -> float:
        if y < LAWN_M or y > BAYS_M:
            return KERB_M
        return float(hump(np.array([x, y])))

    ground("ground", xs, ys, surface, height).build(room, weld=True)
    lines = []
    for bay in range(-3, 3):
        x, y = _bay(bay)
        x += 0.5 * BAY_STEP_M - (y - AISLE_M) / math.tan(BAY_RAD)
        end = BAYS_M - 0.25
        stop = x + (end - AISLE_M) / math.tan(BAY_RAD)
        if WEST_M + 0.1 < x and stop < EAST_M - 0.1:
            lines.append(((x, AISLE_M, 0.0), (stop, end, 0.0), 0.10))
    for_the_eye(paint("bay_lines", lines, "line_white").build(room))
    arrow = [((-6.3, -2.9, 0.0), (-5.2, -2.9, 0.0), 0.12)]
    arrow += [
        ((-5.5, -2.62, 0.0), (-5.1, -2.9, 0.0), 0.12),
        ((-5.5, -3.18, 0.0), (-5.1, -2.9, 0.0), 0.12),
    ]
    for_the_eye(paint("arrow", arrow, "line_white").build(room))


def _shop(room: bpy.types.Collection, furniture: bpy.types.Collection) -> None:
    windows = [
        glazing(
            (u, u + 2.1),
            (0.45, 2.55),
            "shop_glow" if u < 3 else "glass_dark",
            "post_steel",
            panes=3,
        )
        for u in (-6.6, -4.2, 2.2, 4.6)
    ]
    entrance = glazing((-1.5, 1.5), (0.10, 2.6), "shop_glow_cool", "post_steel", panes=4)
    openings = (*windows[:2], entrance, *windows[2:])
    wall = Wall("facade_white", openings, lower="facade_brick", lower_m=0.45)
    build_front(Front("shop", (WEST_M, EAST_M), 4.2, wall), "north", NORTH_M, room)
    sign("shop_sign", 5.2, "sign_blue", 9).build(furniture, location=(0.0, NORTH_M - 0.08, 3.3))
    for index, x in enumerate((-5.55, 5.65)):
        awning(f"awning_{index}", 2.4, 0.8).build(furniture, location=(x, NORTH_M - 0.03, 3.05))
    trolleys("trolleys").build(furniture, location=(2.5, NORTH_M - 0.62, KERB_M))
    for index, x in enumerate(np.arange(-6.2, 6.4, 1.55)):
        bollard(f"bollard_{index}").build(furniture, location=(float(x), BAYS_M + 0.35, KERB_M))


def _surroundings(furniture: bpy.types.Collection, room: bpy.types.Collection) -> None:
    corners = ((6.95, -5.2), (6.95, 5.85), (-6.95, 5.85), (-6.95, -5.2))
    for index, (x, y) in enumerate(corners):
        post = lamp_post(f"lamp_{index}", 4.6, 0.9, "lamp_warm", "post_steel")
        post.build(furniture, location=(x, y, KERB_M), yaw=math.copysign(math.pi / 2, -y))
    ticket_machine("ticket_machine").build(
        furniture, location=(5.9, 0.95, 0.0), yaw=math.radians(240)
    )
    for index, (x, height) in enumerate(((-5.9, 4.1), (-0.6, 3.6), (3.9, 4.2))):
        leaf = "foliage_gold" if index % 2 else "foliage"
        for part in tree(f"tree_{index}", height, leaf, index):
            for_the_eye(part.build(room, location=(x, -7.6, 0.0)))
    hedge = bush("hedge", 14.2, 0.75, "foliage", 7)
    for_the_eye(hedge.build(room, location=(0.0, -6.1, 0.0)))
    beyond = Builder("beyond")
    for x0, x1 in pairwise((-60.0, WEST_M, EAST_M, 60.0)):
        for y0, y1 in pairwise((-60.0, SOUTH_M, BAYS_M, NORTH_M, 60.0)):
            inside = x0 == WEST_M and y0 in (SOUTH_M, BAYS_M)
            if not inside:
                what = "asphalt" if y0 == SOUTH_M else "lawn"
                beyond.sheet([[(x0, y, -0.02), (x1, y, -0.02)] for y in (y0, y1)], what)
    for_the_eye(beyond.build(room))
    _skyline(room)


def _skyline(room: bpy.types.Collection) -> None:
    """Houses and trees around the car park, for the eye."""
    rng = np.random.default_rng(3)
    paints = ("facade_cream", "facade_brick", "facade_slate", "facade_white")
    for index in range(22):
        turn = 2 * math.pi * index / 22 + rng.uniform(-0.05, 0.05)
        away = rng.uniform(24, 30)
        x, y = away * math.cos(turn), away * math.sin(turn)
        if y > 0 and abs(x) < 9:
            continue
        house = Builder(f"house_{index}")
        wide, high = rng.uniform(5, 8), rng.uniform(4.5, 8.5)
        house.box((5.0, wide, high), (0, 0, 0.5 * high), paints[index % 4])
        for row in range(int(high // 2.6)):
            for column in range(3):
                u = (column - 1) * wide / 3.4
                glow = "shop_glow" if rng.random() < 0.3 else "glass_dark"
                house.box((0.1, 1.0, 1.3), (-2.5, u, 1.6 + 2.6 * row), glow)
        for_the_eye(house.build(room, location=(x, y, -0.02), yaw=turn))
        leaf = "foliage" if index % 3 else "foliage_gold"
        place = (0.72 * x + rng.uniform(-3, 3), 0.72 * y + rng.uniform(-3, 3), -0.02)
        for part in tree(f"far_tree_{index}", rng.uniform(4, 6.5), leaf, 40 + index):
            for_the_eye(part.build(room, location=place))


def _light(scene: bpy.types.Scene, stage: bpy.types.Collection) -> None:
    """A low evening sun from the south-west under a pale sky; the shop is already lit."""
    sun((0.80, 0.50, -0.42), 5.6, (1.0, 0.66, 0.36), stage)
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.60, 0.66, 0.86, 1.0)
    background.inputs["Strength"].default_value = 0.55
    for index, x in enumerate((-5.4, 0.0, 5.4)):
        soft_light(
            f"shop_light_{index}",
            (x, NORTH_M - 0.12, 1.6),
            (2.0, 1.8),
            38.0,
            (1.0, 0.80, 0.55),
            stage,
            towards=(0.0, -1.0, -0.2),
        )
    for camera in stage.objects:
        if camera.type == "CAMERA":
            camera.data.clip_end = 150.0
