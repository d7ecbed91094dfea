# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds street: at dusk a van swings around a parked car and stops for someone who crosses."""

from __future__ import annotations

import math

import bpy
import numpy as np

from blender_scenes.assemble import Folders, watch
from blender_scenes.motion.going import Walk
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets.facades import Front, awning, build_front, glazing, sign
from blender_scenes.sets.lighting import lamp, soft_light
from blender_scenes.sets.outdoors import (
    GAP_M,
    bollard,
    for_the_eye,
    ground,
    lamp_post,
    paint,
    street_bin,
    tree,
)
from blender_scenes.sets.shell import Wall, door
from blender_scenes.shapes import Builder
from blender_scenes.stage import add_access_points
from blender_scenes.vehicles.cars import car_model, van_model
from blender_scenes.vehicles.driving import Route, drive
from blender_scenes.vehicles.rig import Vehicle, build_vehicle, key_drive, park

#: Half the length of the radio scene, of the carriageway and of the street between fronts [m].
HALF_M, ROAD_M, FRONT_M = 7.4, 2.6, 5.2
KERB_M = 0.12
#: The zebra crossing lies between these x [m].
ZEBRA_M = (4.5, 6.5)
_SWING_RAD = math.radians(24)
#: In the right lane, around the parked car, and on to the crossing.
ROUTE = Route((-5.9, -0.7), 0.0, ((2.7, _SWING_RAD), (2.7, -_SWING_RAD), (1.4, 0.0)))
SPEEDS = ((0.0, 2.0), (2.0, 1.6), (5.0, 0.0), (10.0, 0.0))
CAMERAS = (
    (7.2, -4.0, 2.4), (-7.2, 3.9, 3.4), (7.2, 4.0, 3.2), (-7.2, -3.9, 2.8), (9.6, -0.6, 1.8),
    (-9.6, 0.4, 2.4), (7.2, -1.5, 4.2), (-7.2, 3.0, 4.6), (7.2, 3.0, 2.2), (9.0, 2.4, 3.2),
    (-9.4, -3.6, 3.0), (7.2, 0.4, 4.2),
)  # fmt: skip


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    _ground(folders["Room"])
    _fronts(folders["Room"], folders["Furniture"])
    _furniture(folders["Furniture"])
    _distance(folders["Room"])
    park("parked", car_model("car_blue", lit=False), (-0.5, -1.8, GAP_M), 0.0, folders["Furniture"])
    model = van_model("van_white", "van_stripe")
    van = build_vehicle("van", model, folders["Person"])
    key_drive(van, drive(ROUTE, model.chassis, scene.frame_end, scene.render.fps, SPEEDS))
    stroller = cast(PEOPLE["georg"], folders["Person"])
    perform(
        stroller,
        [Walk([(-3.0, 3.4), (0.6, 3.7)], 0.95, open_start=True, open_end=True)],
        Posture((-5.9, 3.7), math.radians(-6), floor_m=KERB_M),
        scene,
    )
    crossing = cast(PEOPLE["anna"], folders["Person"])
    perform(
        crossing,
        [Walk([(5.3, 2.2)], 1.0)],
        Posture((5.5, -2.2), math.radians(92)),
        scene,
        frame_start=12,
    )
    places = [(6.9, -4.9, 3.2), (6.9, 4.9, 2.4), (-6.9, 4.9, 3.5), (-6.9, -4.9, 3.2)]
    add_access_points(places, (0.0, 0.0), folders["Stage"])
    people = [stroller.armature, crossing.armature]
    watch(scene, CAMERAS, [*people, van.root], folders["Stage"])
    _light(scene, van, folders["Stage"])


def _ground(room: bpy.types.Collection) -> None:
    ys = [-FRONT_M, -ROAD_M - 0.16, -ROAD_M, ROAD_M, ROAD_M + 0.16, FRONT_M]
    xs = [-HALF_M, *ZEBRA_M, HALF_M]

    def surface(_x: float, y: float) -> str:
        if abs(y) < ROAD_M:
            return "asphalt_wet"
        return "kerb_stone" if abs(y) < ROAD_M + 0.16 else "paving"

    def height(x: float, y: float) -> float:
        lowered = ZEBRA_M[0] <= x <= ZEBRA_M[1]
        return 0.0 if abs(y) < ROAD_M or (lowered and abs(y) < ROAD_M + 0.16) else KERB_M

    ground("ground", xs, ys, surface, height).build(room, weld=True)
    stripes = []
    for index in range(6):
        y = -ROAD_M + 0.45 + 0.86 * index
        stripes.append(((ZEBRA_M[0], y, 0.0), (ZEBRA_M[1], y, 0.0), 0.45))
    for index in range(4):
        x = -7.0 + 2.9 * index
        stripes.append(((x, 0.0, 0.0), (x + 1.5, 0.0, 0.0), 0.10))
    for_the_eye(paint("road_marks", stripes, "line_white").build(room))


def _house(
    name: str, x_m: tuple[float, float], height_m: float, paints: tuple[str, str, str], lit: str
) -> Front:
    """A shop below and flats above: surfaces of wall, base and frames; which windows are `lit`."""
    wall, base, frame = paints
    wide = x_m[1] - x_m[0]
    shop = glazing((-0.42 * wide, 0.12 * wide), (0.5, 2.7), "shop_glow", frame, panes=3)
    entry = door((0.22 * wide, 0.22 * wide + 0.95), leaf="door_wood", panel="door_panel")
    upper = []
    for index, glow in enumerate(lit):
        glass = {"w": "shop_glow", "c": "shop_glow_cool", "-": "glass_dark"}[glow]
        u = (index + 0.5) / len(lit) * wide - 0.5 * wide
        upper.append(glazing((u - 0.5, u + 0.5), (3.7, 5.2), glass, frame))
    return Front(name, x_m, height_m, Wall(wall, (shop, entry, *upper), lower=base, lower_m=3.2))


def _fronts(room: bpy.types.Collection, furniture: bpy.types.Collection) -> None:
    cream = ("facade_cream", "facade_white", "walnut")
    brick = ("facade_brick", "facade_slate", "post_green")
    slate = ("facade_slate", "facade_cream", "white_wood")
    white = ("facade_white", "facade_brick", "post_steel")
    for side, sign_y, turn, houses in (
        (
            "north",
            FRONT_M,
            0.0,
            (
                _house("house_bakery", (-HALF_M, -2.2), 6.0, cream, "w-w"),
                _house("house_books", (-2.2, 2.6), 6.6, brick, "-cw"),
                _house("house_cafe", (2.6, HALF_M), 5.8, slate, "ww-"),
            ),
        ),
        (
            "south",
            -FRONT_M,
            math.pi,
            (
                _house("house_tailor", (-HALF_M, -2.8), 6.3, white, "-w-"),
                _house("house_grocer", (-2.8, 2.2), 5.8, slate, "w-c"),
                _house("house_florist", (2.2, HALF_M), 6.4, cream, "-ww"),
            ),
        ),
    ):
        for index, house in enumerate(houses):
            build_front(house, side, math.copysign(FRONT_M, sign_y), room)
            middle = 0.5 * (house.x_m[0] + house.x_m[1])
            inward = -math.copysign(1.0, sign_y)
            board = ("sign_blue", "post_green", "fire_red")[(index + (side == "south")) % 3]
            name = house.name.replace("house", "sign")
            sign(name, 2.6, board, 6 + index).build(
                furniture, location=(middle - 0.7, sign_y + 0.08 * inward, 3.25), yaw=turn
            )
            if index != 1:
                awning(name.replace("sign", "awning"), 2.9, 1.0).build(
                    furniture, location=(middle - 0.7, sign_y + 0.03 * inward, 3.0), yaw=turn
                )


def _furniture(furniture: bpy.types.Collection) -> None:
    for index, (x, y) in enumerate(((-4.2, 2.95), (3.6, 2.95), (-2.6, -2.95), (6.95, -2.95))):
        post = lamp_post(f"lamp_{index}", 4.4, 0.9, "lamp_warm", "post_green")
        post.build(furniture, location=(x, y, KERB_M), yaw=math.copysign(math.pi / 2, -y))
    for index, x in enumerate((-6.6, -5.5, 1.0, 2.2, 3.3)):
        for side in (-1, 1):
            bollard(f"bollard_{index}_{side}").build(
                furniture, location=(x, side * (ROAD_M + 0.32), KERB_M)
            )
    street_bin("bin_north").build(furniture, location=(2.9, 4.6, KERB_M))
    street_bin("bin_south").build(furniture, location=(-4.4, -4.6, KERB_M))
    for index in range(3):
        x = -1.6 + 0.7 * index
        crate = Builder(f"crate_{index}")
        crate.box((0.55, 0.40, 0.34), (0, 0, GAP_M + 0.17), "pallet_wood", bevel=0.01)
        fruit = ("paint_rust", "foliage", "line_yellow")[index]
        for apple in range(12):
            place = (0.12 * (apple % 4) - 0.18, 0.11 * (apple // 4) - 0.11, 0.385)
            ball = [(0.012, -0.045), (0.045, -0.02), (0.05, 0.01), (0.03, 0.045), (0.01, 0.05)]
            crate.lathe(ball, place, fruit, sides=8)
        crate.build(furniture, location=(x, -4.85, KERB_M))


def _distance(room: bpy.types.Collection) -> None:
    """The street goes on, for the eye."""
    beyond = Builder("beyond")
    for direction in (-1, 1):
        xs = sorted((direction * HALF_M, direction * 45.0))
        for y0, y1, what, z in (
            (-FRONT_M, -ROAD_M, "paving", KERB_M),
            (-ROAD_M, ROAD_M, "asphalt_wet", 0.0),
            (ROAD_M, FRONT_M, "paving", KERB_M),
        ):
            beyond.sheet([[(x, y, z - 0.004) for x in xs] for y in (y0, y1)], what)
    for_the_eye(beyond.build(room))
    _far_houses(room)
    for direction in (-1, 1):
        end = Builder(f"end_{direction}")
        end.box((4.0, 12.0, 9.0), (0, 0, 4.5), "facade_slate")
        for level in range(3):
            for column in range(5):
                glow = "shop_glow" if (level + 2 * column) % 3 == 0 else "glass_dark"
                y, z = 2.2 * (column - 2), 2.0 + 2.5 * level
                end.box((0.1, 1.0, 1.4), (-2.0 * direction, y, z), glow)
        for_the_eye(end.build(room, location=(direction * 40.0, 0.0, 0.0)))


def _far_houses(room: bpy.types.Collection) -> None:
    """Houses and trees on both sides of where the street goes on."""
    rng = np.random.default_rng(5)
    paints = ("facade_cream", "facade_brick", "facade_slate", "facade_white")
    for index in range(16):
        direction, side, row = (-1, 1)[index % 2], (-1, 1)[index // 2 % 2], index // 4
        house = Builder(f"far_house_{index}")
        high = rng.uniform(6, 8.5)
        house.box((7.2, 5.0, high), (0, 2.5, 0.5 * high), paints[(index + row) % 4])
        for level in range(int(high // 2.4)):
            for column in range(4):
                glow = "shop_glow" if rng.random() < 0.4 else "glass_dark"
                house.box((1.0, 0.1, 1.3), (1.75 * (column - 1.5), 0.0, 1.7 + 2.3 * level), glow)
        x = direction * (HALF_M + 3.65 + 7.3 * row)
        turned = math.pi if side < 0 else 0.0
        for_the_eye(house.build(room, location=(x, side * FRONT_M, 0.0), yaw=turned))
        if row < 3:
            place = (direction * (HALF_M + 2.5 + 7.0 * row), side * 3.9, KERB_M)
            for part in tree(f"far_tree_{index}", 4.6, "foliage", 70 + index):
                for_the_eye(part.build(room, location=place))


def _light(scene: bpy.types.Scene, van: Vehicle, stage: bpy.types.Collection) -> None:
    """Blue dusk, warm street lamps, lit shops and the van's beams on wet asphalt."""
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.16, 0.26, 0.52, 1.0)
    background.inputs["Strength"].default_value = 0.62
    warm = (1.0, 0.64, 0.30)
    for index, (x, y) in enumerate(((-4.2, 1.9), (3.6, 1.9), (-2.6, -1.9), (6.95, -1.9))):
        bulb = lamp(f"street_light_{index}", "SPOT", 620.0, warm, stage)
        bulb.location = (x, y, 4.5)
        bulb.data.spot_size, bulb.data.spot_blend = math.radians(140), 0.6
        bulb.data.shadow_soft_size = 0.12
    for index, (x, side) in enumerate(
        ((-5.2, 1), (-0.2, 1), (4.6, 1), (-5.5, -1), (-0.7, -1), (4.4, -1))
    ):
        soft_light(
            f"shop_light_{index}",
            (x, side * (FRONT_M - 0.05), 1.7),
            (2.4, 1.8),
            52.0,
            (1.0, 0.72, 0.42),
            stage,
            towards=(0.0, -side, -0.25),
        )
    for side in (-1, 1):
        beam = lamp(f"van_beam_{side}", "SPOT", 300.0, (1.0, 0.93, 0.80), stage)
        beam.data.spot_size, beam.data.spot_blend = math.radians(58), 0.5
        beam.data.shadow_soft_size = 0.05
        beam.location = (3.72, 0.62 * side, 0.72)
        beam.rotation_euler = (0.0, math.radians(-84), 0.0)
        van.attach(beam)
    for camera in stage.objects:
        if camera.type == "CAMERA":
            camera.data.clip_end = 150.0
