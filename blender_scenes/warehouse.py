# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds warehouse: a forklift brings a pallet to a rack and lifts it while a worker walks by."""

from __future__ import annotations

import math

import bpy
import numpy as np

from blender_scenes.assemble import Folders, watch
from blender_scenes.motion.going import Stay, Walk
from blender_scenes.motion.rotations import smoothstep
from blender_scenes.motion.score import Posture
from blender_scenes.people.cast import PEOPLE, cast, perform
from blender_scenes.sets.hall import exit_sign, extinguisher
from blender_scenes.sets.lighting import COOL, lamp, soft_light
from blender_scenes.sets.outdoors import for_the_eye, paint
from blender_scenes.sets.shell import Opening, Shell, Wall, build_shell, door
from blender_scenes.sets.storage import (
    BAY_M,
    GAP_M,
    LEVELS_M,
    drum,
    high_bay_lamp,
    pallet,
    rack,
    safety_barrier,
)
from blender_scenes.stage import add_access_points, corners
from blender_scenes.vehicles.driving import Route, drive
from blender_scenes.vehicles.forklift import FORK_M, LOAD_X_M, carriage, forklift_model
from blender_scenes.vehicles.rig import Vehicle, build_vehicle, key_drive

_TURN_RAD = math.radians(84)
#: Along the middle aisle, then left towards the rack at the north wall.
ROUTE = Route((-3.3, -2.0), 0.0, ((2.4, 0.0), (3.6, _TURN_RAD), (0.9, 0.0)))
SPEEDS = ((0.0, 1.5), (2.0, 1.35), (4.2, 1.0), (5.9, 0.0), (10.0, 0.0))
#: The forks go from the first height to the second above their lowest [m] at these times [s].
LIFT_M, LIFT_S = (0.10, 1.05), (5.2, 7.8)
#: An open dock door with daylight behind it, and one that is shut.
OPEN_DOCK = Opening(
    (-2.9, 0.3),
    (0.0, 3.4),
    0.15,
    ((0.03, "machine_yellow"), (0.94, ""), (0.03, "machine_yellow")),
    ((0.97, "window_pane"), (0.03, "machine_grey")),
    "machine_yellow",
)
SHUT_DOCK = Opening(
    (1.1, 4.3),
    (0.0, 3.4),
    0.15,
    ((0.03, "machine_yellow"), (0.94, ""), (0.03, "machine_yellow")),
    tuple((1 / 9, ("dock_door", "cladding")[row % 2]) for row in range(9)),
    "machine_yellow",
)
SHELL = Shell(
    (14.0, 9.8, 5.6),
    south=Wall("cladding", lower="bare_concrete", lower_m=1.2),
    north=Wall("cladding", lower="bare_concrete", lower_m=1.2),
    east=Wall(
        "cladding", (door((-4.2, -3.2), leaf="locker_blue"),), lower="bare_concrete", lower_m=1.2
    ),
    west=Wall("cladding", (OPEN_DOCK, SHUT_DOCK), lower="bare_concrete", lower_m=1.2),
    floor="hall_floor",
    ceiling="roof_sheet",
    skirting="bare_concrete",
)
CAMERAS = (
    (6.7, -4.6, 3.0), (-6.7, -4.6, 3.2), (6.7, 2.6, 2.4), (-6.7, -2.4, 2.4), (6.7, 3.1, 4.4),
    (-6.7, -0.3, 3.6), (6.7, 0.6, 4.2), (-6.7, -3.6, 1.7), (6.7, -3.0, 4.4), (-6.7, -1.2, 4.6),
    (6.7, -4.6, 4.8), (-6.7, -4.6, 4.8),
)  # fmt: skip


def fill(scene: bpy.types.Scene, folders: Folders) -> None:
    """Puts everything into the scene."""
    build_shell(SHELL, folders["Room"])
    _racks(folders["Furniture"])
    _details(folders["Furniture"], folders["Room"])
    model = forklift_model()
    truck = build_vehicle("forklift", model, folders["Person"])
    key_drive(truck, drive(ROUTE, model.chassis, scene.frame_end, scene.render.fps, SPEEDS))
    _lift(scene, truck, folders["Person"])
    worker = cast(PEOPLE["ivan"], folders["Person"])
    perform(
        worker,
        [Walk([(4.7, -2.4), (4.5, 0.5)], 1.05, open_start=True), Stay(3.0)],
        Posture((5.9, -3.9), math.radians(125)),
        scene,
    )
    add_access_points(corners(SHELL.half_m, (2.4, 3.6)), (0.0, 0.0), folders["Stage"])
    watch(scene, CAMERAS, [worker.armature, truck.root], folders["Stage"])
    _light(scene, folders["Stage"])


def _lift(scene: bpy.types.Scene, truck: Vehicle, person: bpy.types.Collection) -> None:
    """Adds the fork carriage with its pallet and keys its height."""
    forks = truck.attach(carriage("forklift_carriage").build(person))
    load = truck.attach(pallet("forklift_load", 5, 0.95).build(person, yaw=math.pi / 2))
    low, high = LIFT_M
    for frame in range(1, scene.frame_end + 1):
        share = ((frame - 1) / scene.render.fps - LIFT_S[0]) / (LIFT_S[1] - LIFT_S[0])
        height = low + (high - low) * smoothstep(min(max(share, 0.0), 1.0))
        forks.location.z = height
        load.location = (LOAD_X_M, 0.0, FORK_M + height + 0.002)
        for item in (forks, load):
            item.keyframe_insert("location", frame=frame)
    for item in (forks, load):
        item.animation_data.action.name = f"{item.name}_lift"


def _racks(furniture: bpy.types.Collection) -> None:
    number = 0
    for name, bays, x, y, free in (
        ("rack_north", 4, 0.9, 4.15, {(2, 1, 0), (2, 1, 1), (3, 0, 1)}),
        ("rack_middle", 2, -3.4, 1.25, {(1, 2, 0)}),
    ):
        rack(name, bays).build(furniture, location=(x, y, 0.0))
        for bay in range(bays):
            for level, z in enumerate(LEVELS_M):
                for half in (0, 1):
                    number += 1
                    if (bay, level, half) in free:
                        continue
                    place = x + (bay - 0.5 * bays + 0.5) * BAY_M + (half - 0.5) * 1.3
                    stack = pallet(
                        f"pallet_{name}_{bay}{level}{half}", number, 0.75 + 0.05 * (number % 8)
                    )
                    stack.build(furniture, location=(place, y, z + GAP_M))


def _details(furniture: bpy.types.Collection, room: bpy.types.Collection) -> None:
    for index, (x, y) in enumerate(((-6.3, -4.2), (-5.6, -4.35), (-6.35, -3.5))):
        drum(f"drum_{index}").build(furniture, location=(x, y, 0.0))
    for index, (x, y, yaw) in enumerate(
        ((1.1, -4.25, 0.0), (-1.0, -4.25, 0.05), (2.6, -4.25, -0.04))
    ):
        stack = pallet(f"pallet_south_{index}", 30 + index, 0.6 + 0.2 * index)
        stack.build(furniture, location=(x, y, GAP_M), yaw=yaw)
    safety_barrier("barrier_middle", 1.1).build(
        furniture, location=(-0.42, 1.25, 0.0), yaw=math.pi / 2
    )
    extinguisher("extinguisher").build(furniture, location=(6.9, -1.6, 0.75), yaw=math.pi / 2)
    exit_sign("exit_sign").build(furniture, location=(6.9, -3.7, 2.5), yaw=math.pi / 2)
    stripes = [((x, -3.55, 0.0), (x + 13.4, -3.55, 0.0), 0.09) for x in (-6.7,)]
    stripes += [
        ((-6.7, -0.3, 0.0), (0.3, -0.3, 0.0), 0.09),
        ((0.3, -0.3, 0.0), (0.3, 3.3, 0.0), 0.09),
    ]
    stripes += [((3.6, -0.3, 0.0), (3.6, 3.3, 0.0), 0.09)]
    for_the_eye(paint("aisle_marks", stripes, "line_yellow").build(room))
    for index, (x, y) in enumerate(
        ((-4.4, -2.0), (0.2, -2.0), (4.6, -2.0), (-3.4, 2.7), (2.6, 2.2))
    ):
        tray = high_bay_lamp(f"tray_{index}")
        for_the_eye(tray.build(room, location=(x, y, 4.85)))


def _light(scene: bpy.types.Scene, stage: bpy.types.Collection) -> None:
    """Cold high-bay lamps, and warm morning light that falls in through the open dock."""
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.70, 0.80, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.25
    for index, (x, y) in enumerate(
        ((-4.4, -2.0), (0.2, -2.0), (4.6, -2.0), (-3.4, 2.7), (2.6, 2.2))
    ):
        soft_light(f"high_bay_{index}", (x, y, 4.8), (1.6, 0.8), 105.0, COOL, stage)
    morning = lamp("morning", "AREA", 260.0, (1.0, 0.74, 0.46), stage)
    morning.data.shape, morning.data.size, morning.data.size_y = "RECTANGLE", 2.8, 3.0
    morning.data.spread = math.radians(60)
    morning.location = (-6.85, -1.3, 2.0)
    morning.rotation_euler = (0.0, math.radians(-72), 0.0)
    morning.visible_camera = morning.visible_glossy = False
    for index, x in enumerate(np.linspace(-4.0, 4.0, 3)):
        soft_light(
            f"fill_{index}",
            (float(x), -4.75, 4.4),
            (2.5, 0.8),
            22.0,
            COOL,
            stage,
            towards=(0.0, 1.0, -0.6),
        )
