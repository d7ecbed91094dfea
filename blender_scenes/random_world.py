# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a random world of `rfgs_core.worlds` as a scene: what the fast tracer draws, to be seen.

`python -m blender_scenes world WORLDS.json --index 12 --out world.blend`, where WORLDS.json is the
file that `rfgs-factory worlds` writes into its folder:

    {"radio": {…}, "settings": {"frames": 8, "fps": 10.0, "people": [1, 2], …}, "seed": 0}
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

from blender_scenes.assemble import Folders, save_scene, watch
from blender_scenes.motion.skeleton import Pose
from blender_scenes.people.action import key_poses
from blender_scenes.people.body import Body
from blender_scenes.people.character import add_armature, add_skin, follow
from blender_scenes.sets.lighting import COOL, ceiling_row
from blender_scenes.stage import Point, around_room
from blender_scenes.surface import Surface
from blender_scenes.surfaces import SURFACES, new_material
from rfgs_core.articulated.bones import BONES, PARENTS
from rfgs_core.radio import DevicePose
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.worlds.cast import Actor
from rfgs_core.worlds.furniture import Mesh
from rfgs_core.worlds.settings_file import WorldsFile, read_worlds_file
from rfgs_core.worlds.world import World, random_world

#: Texture of what rooms and furniture are made of; others have one colour.
_TEXTURES = {"concrete": "weave", "wood": "grain", "brick": "bricks", "chipboard": "weave"}
#: Part of a person that each bone moves, by the first letters of its name, as surfaces call it.
_WORN = {
    "foot": "shoes", "upperleg": "trousers", "lowerleg": "trousers", "pelvis": "trousers",
    "spine": "shirt", "clavicle": "shirt", "upperarm": "shirt",
}  # fmt: skip
#: Shirts and trousers that people are drawn with, linear RGB.
_CLOTHS = (
    (0.55, 0.085, 0.065), (0.035, 0.05, 0.10), (0.10, 0.35, 0.12), (0.62, 0.50, 0.52),
    (0.10, 0.35, 0.55), (0.85, 0.30, 0.02), (0.25, 0.20, 0.14), (0.20, 0.25, 0.33),
)  # fmt: skip
#: Cameras stay this far below a ceiling, where they would be higher otherwise [m].
_BELOW_CEILING_M = 0.2
#: Bones as the scene has them. The add-on takes a bone called pelvis for the joint of that name,
#: which lies between the hips here.
_BONES = ("root", *BONES[1:])


def build(source: Path, index: int, out: Path) -> World:
    """Builds a world and saves it, compressed, as `out`.

    Args:
        source: What worlds have in common, as `rfgs-factory worlds` writes it.
        index: Number of the world.
        out: The .blend to write.

    Raises:
        RfgsError: The file is damaged, or no such world has room for its people.
    """
    shared = read_worlds_file(source)
    world = random_world(shared.radio, shared.settings, shared.seed, index)

    def fill(scene: bpy.types.Scene, folders: Folders) -> None:
        for part in world.setting.parts:
            _part(world, part, folders["Room"])
        people = [
            _person(number, actor, shared, index, folders["Person"])
            for number, actor in enumerate(world.actors, start=1)
        ]
        for device in world.devices:
            folders["Stage"].objects.link(_device(device))
        _light(world, folders["Stage"])
        watch(scene, _cameras(world), people, folders["Stage"])

    # A scene of one frame is no animation to the add-on.
    frames = max(shared.settings.frames, 2)
    save_scene(out, out.stem, frames, round(shared.settings.fps), fill)
    return world


def _part(world: World, part: Mesh, folder: bpy.types.Collection) -> None:
    """A wall, the floor or a piece of furniture."""
    mesh = bpy.data.meshes.new(part.name)
    corners, faces = np.unique(part.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    mesh.from_pydata(corners.tolist(), [], faces.reshape(-1, 3).tolist())
    mesh.materials.append(_slab(world.setting.materials[part.material].name))
    folder.objects.link(bpy.data.objects.new(part.name, mesh))


def _slab(name: str) -> bpy.types.Material:
    known = MATERIALS[name]
    red, green, blue = (0.8 * value for value in known.colour)
    surface = Surface(
        known.colour, name, known.thickness_m, _TEXTURES.get(name, "plain"), (red, green, blue)
    )
    return bpy.data.materials.get(name) or new_material(name, surface)


def _person(
    number: int, actor: Actor, shared: WorldsFile, index: int, folder: bpy.types.Collection
) -> bpy.types.Object:
    """Somebody as a rigged mesh that plays her or his motion."""
    name, body = f"person_{number}", _dense(actor)
    armature = add_armature(name, body, folder)
    materials, of_face = _clothes(name, actor, [shared.seed, index, number])
    skin = add_skin(name, body, materials, folder, least_weight=0.0)
    skin.data.polygons.foreach_set("material_index", of_face.astype(np.int32))
    follow(armature, skin)
    settings = shared.settings
    times = (np.arange(settings.frames + 2) - 1.0) / settings.fps
    poses = [actor.pose(float(time_s)) for time_s in times]
    keys = [Pose(pose.root, dict(zip(_BONES, pose.turns, strict=True))) for pose in poses]
    # A frame before the first and after the last, between which velocities are taken.
    key_poses(armature, keys, [actor.motion.family] * len(keys), 0)
    return armature


def _dense(actor: Actor) -> Body:
    """The body as builders of characters take it: a weight for every vertex and bone."""
    bone, weight = actor.body.weights
    dense = np.zeros((len(bone), len(BONES)))
    np.add.at(dense, (np.arange(len(bone))[:, None], bone.astype(np.int64)), weight)
    return Body(
        actor.body.vertices, actor.body.faces, _BONES, PARENTS, np.array(actor.body.heads), dense
    )


def _clothes(
    name: str, actor: Actor, seed: list[int]
) -> tuple[list[bpy.types.Material], np.ndarray]:
    """Materials of a person, and which of them each triangle has; all are skin to the radio."""
    bone, weight = actor.body.weights
    heaviest = np.take_along_axis(bone, weight.argmax(axis=1)[:, None], axis=1)[:, 0]
    worn = [next((w for key, w in _WORN.items() if b.startswith(key)), "skin") for b in BONES]
    slots = sorted(set(worn))
    drawn = np.random.default_rng(seed).permutation(len(_CLOTHS))
    cloth = {"shirt": drawn[0], "trousers": drawn[1]}
    materials = []
    for slot in slots:
        surface = replace(SURFACES[slot], texture="plain")
        if slot in cloth:
            surface = replace(surface, colour=_CLOTHS[cloth[slot]])
        surface = replace(surface, thickness_m=MATERIALS["skin"].thickness_m)
        materials.append(new_material(f"{name}_{slot}", surface))
    of_bone = np.array([slots.index(each) for each in worn])
    bones = heaviest.astype(np.int64)[actor.body.faces[:, 0]]
    of_face = of_bone[bones]
    # A hem runs level, not along the border between two bones.
    waist = bones <= BONES.index("spine_lower")
    above = actor.body.vertices[actor.body.faces, 2].mean(axis=1) > actor.body.heads[0, 2]
    of_face[waist] = np.where(above[waist], slots.index("shirt"), slots.index("trousers"))
    return materials, of_face


def _device(device: DevicePose) -> bpy.types.Object:
    made = bpy.data.objects.new(device.name, None)
    made.empty_display_type, made.empty_display_size = "ARROWS", 0.15
    made.location = device.position_m
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = Quaternion(device.quat_wxyz)
    made.rfgs.role, made.rfgs.radio = device.role, "any"
    return made


def _light(world: World, folder: bpy.types.Collection) -> None:
    """Four lamps below the ceiling, as bright as the floor is large."""
    low, high = world.setting.bounds_m
    x, y = 0.25 * (high - low)[:2]
    places = [(a, b, float(high[2]) - 0.08) for a in (-x, x) for b in (-y, y)]
    ceiling_row(places, (0.8, 0.3), 1.6 * float(np.prod((high - low)[:2])), COOL, folder)


def _cameras(world: World) -> list[Point]:
    low, high = world.setting.bounds_m
    half = 0.5 * (high - low)[:2]
    most = float(high[2]) - _BELOW_CEILING_M
    return around_room((float(half[0]), float(half[1])), (min(2.4, most), 1.5, 1.95))
