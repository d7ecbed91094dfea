# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a scene around motion capture: one of our people plays it in a room that fits."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from blender_scenes.assemble import Folders, save_scene, set_up
from blender_scenes.motion.recorded import Recorded, poses_of
from blender_scenes.motion.score import Figure, Posture, Score, compose
from blender_scenes.people.cast import PEOPLE, Actor, cast, key_score
from blender_scenes.sets.lighting import COOL, ceiling_row
from blender_scenes.sets.room import Room
from blender_scenes.sets.shell import Shell, Wall, door
from rfgs_core.motion_capture import Recording, read_recording

#: From what a joint reaches to the walls and to the ceiling [m].
MARGIN_M, HEADROOM_M = 1.2, 0.6
#: No room is smaller [m], and none larger: beyond it the unit of the file was meant otherwise.
SMALLEST_M, LARGEST_M = (4.0, 4.0, 2.7), 40.0
#: Frames of a scene, at most.
MOST_FRAMES = 10_000


def build(path: Path, out: Path, person: str, fps: int, up: str, repeat: int) -> int:
    """Builds the scene and saves it, compressed, as `out`.

    Args:
        path: A .bvh, whose limbs' lengths do not matter, nor does its unit, or a clip of
            DeepMimic's format (.txt, .json).
        out: The .blend to write.
        person: Who plays it, one of `PEOPLE`.
        fps: Frames per second of the scene.
        up: Axis that is up in the file, `y` or `z`.
        repeat: How many times it is played, each from where the last one ended.

    Returns:
        Number of frames.

    Raises:
        RfgsFormatError: The file is no recording of a person, or is damaged.
        ValueError: It is too long or goes too far; or there is no such person.
    """
    if person not in PEOPLE:
        raise ValueError(f"no person {person!r}; there are: {', '.join(PEOPLE)}")
    recording = read_recording(path).repeated(repeat, up)
    frames = 1 + int(np.ceil(recording.frame_s * (len(recording.root) - 1) * fps))
    if not 2 <= frames <= MOST_FRAMES:
        raise ValueError(
            f"{path}: {frames} frames at {fps} fps; expected 2 to {MOST_FRAMES}, choose "
            "another --fps or cut the recording"
        )

    def fill(scene: bpy.types.Scene, folders: Folders) -> None:
        actor = cast(PEOPLE[person], folders["Person"])
        score, size_m = _staged(actor.figure, recording, path, up)
        key_score(actor, score, fps, 1, frames)
        _surround(scene, folders, actor, size_m)

    save_scene(out, path.stem, frames, fps, fill)
    return frames


def _staged(
    figure: Figure, recording: Recording, path: Path, up: str
) -> tuple[Score, tuple[float, float, float]]:
    """The recording in the middle of a room, and the size of that room [m]."""
    poses = poses_of(recording, figure.skeleton, up)
    joints = np.array([figure.skeleton.joints(pose) for pose in poses])
    reach = np.ptp(joints.reshape(-1, 3), axis=0)
    if not (np.isfinite(reach).all() and reach[:2].max() < LARGEST_M - 2.0 * MARGIN_M):
        raise ValueError(
            f"{path}: goes {reach[:2].max():.3g} m far; expected less than "
            f"{LARGEST_M - 2.0 * MARGIN_M:g} m"
        )
    piece = Recorded(recording, "recorded", up)
    there = compose(figure, Posture((0.0, 0.0), 0.0), [piece])
    times = np.linspace(0.0, there.duration_s, max(2, int(25 * there.duration_s)))
    places = np.array([figure.skeleton.joints(there.pose(float(t))) for t in times])
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    middle = 0.5 * (low + high)
    size = np.maximum(high - low + 2.0 * MARGIN_M, SMALLEST_M)
    size[2] = max(SMALLEST_M[2], high[2] + HEADROOM_M)
    start = Posture((-float(middle[0]), -float(middle[1])), 0.0)
    return compose(figure, start, [piece]), (float(size[0]), float(size[1]), float(size[2]))


def _surround(
    scene: bpy.types.Scene, folders: Folders, actor: Actor, size_m: tuple[float, float, float]
) -> None:
    """An empty room with a door, lamps, access points in its corners, and cameras."""
    half_x, half_y = 0.5 * size_m[0], 0.5 * size_m[1]
    lamps = [
        (x, y, size_m[2] - 0.08)
        for x in (-0.5 * half_x, 0.5 * half_x)
        for y in (-0.5 * half_y, 0.5 * half_y)
    ]
    room = Room(
        Shell(
            size_m,
            south=Wall("wall_paint"),
            north=Wall("wall_grey"),
            east=Wall("wall_blue"),
            west=Wall("wall_paint", (door((-0.5, 0.5), leaf="paint_teal"),)),
            floor="linoleum",
        ),
        lambda _to: None,
        lambda to: ceiling_row(lamps, (1.2, 0.3), 26.0, COOL, to),
    )
    room.build(folders)
    set_up(scene, folders, room.shell.half_m, [actor.armature])
