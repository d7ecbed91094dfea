# SPDX-License-Identifier: GPL-3.0-or-later
"""People as scenes use them: cast a person, then let her or him perform.

Example:
    >>> anna = cast(PEOPLE["anna"], folders["Person"])
    >>> perform(anna, [Walk([(2.0, 0.0)], 1.2), Turn(90), Stay(2.0)], Posture((0, 0), 0.0), scene)

Frames, labels and instance masks follow: the armature is called `anna`, its mesh `anna_body`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from blender_scenes.motion.gait import Manner
from blender_scenes.motion.score import Figure, Piece, Posture, Score, compose
from blender_scenes.motion.skeleton import skeleton_of
from blender_scenes.people.action import key_breath, key_poses
from blender_scenes.people.body import Phenotype, load_body
from blender_scenes.people.character import add_breath, build_character
from blender_scenes.people.clothes import Look, dress


@dataclass(frozen=True)
class Person:
    """Someone who can be cast."""

    name: str
    """Name of the armature and of the instance in masks."""
    phenotype: Phenotype = field(default_factory=Phenotype)
    """The body."""
    look: Look = field(default_factory=Look)
    """Clothes and colours."""
    manner: Manner = field(default_factory=Manner)
    """How she or he moves."""
    breath_m: float = 0.006
    """How far the chest moves out in a breath [m]."""


@dataclass(frozen=True)
class Actor:
    """A person who stands in the scene."""

    person: Person
    """Who."""
    figure: Figure
    """The body's joints and manner, for `compose`."""
    armature: bpy.types.Object
    """The armature; its child is the skin."""

    @property
    def skin(self) -> bpy.types.Object:
        """The skinned mesh."""
        return next(child for child in self.armature.children if child.type == "MESH")


def cast(person: Person, collection: bpy.types.Collection) -> Actor:
    """Builds a person's rigged body in the scene, in the rest pose at the origin."""
    body = dress(load_body(person.phenotype), person.look)
    armature = build_character(person.name, body, collection, person.look)
    actor = Actor(person, Figure(skeleton_of(body), person.manner), armature)
    add_breath(actor.skin, body, person.breath_m)
    return actor


def perform(
    actor: Actor,
    pieces: Sequence[Piece],
    start: Posture,
    scene: bpy.types.Scene,
    frame_start: int = 1,
) -> None:
    """Writes what an actor does, cut where the scene ends, or the last posture held until then.

    Raises:
        ValueError: A piece cannot be done from where the one before it ended.
    """
    score = compose(actor.figure, start, pieces)
    key_score(actor, score, scene.render.fps, frame_start, scene.frame_end)


def key_score(actor: Actor, score: Score, fps: float, frame_start: int, frame_end: int) -> None:
    """Writes a score, one key per frame, frames inclusive."""
    times = np.arange(frame_end - frame_start + 1) / fps
    poses = [score.pose(float(time_s)) for time_s in times]
    labels = [score.label(float(time_s)) for time_s in times]
    key_poses(actor.armature, poses, labels, frame_start)
    key_breath(actor.skin, [pose.breath for pose in poses], frame_start)


#: Nine people: all ages, both genders, no two alike.
PEOPLE = {
    person.name: person
    for person in (
        Person(
            "anna",
            Phenotype(gender=0.95, age=0.62, weight=0.42, height=0.46),
            Look(
                skin=(0.66, 0.40, 0.29), hair=(0.17, 0.075, 0.03), shirt=(0.08, 0.26, 0.30),
                trousers=(0.10, 0.10, 0.11), shoes=(0.30, 0.05, 0.05), sleeve=1.85, hair_m=0.05,
            ),
            Manner(sway=1.35, arm_swing=1.05, cadence=1.05, breaths_per_min=15),
        ),
        Person(
            "ben",
            Phenotype(gender=0.03, age=0.66, weight=0.60, height=0.43, muscle=0.72),
            Look(
                skin=(0.20, 0.10, 0.06), hair=(0.012, 0.01, 0.008), shirt=(0.62, 0.47, 0.10),
                trousers=(0.16, 0.13, 0.09), shoes=(0.05, 0.05, 0.05), loose=1.2,
            ),
            Manner(arm_swing=1.25, bounce=1.15, cadence=0.96, toe_out_rad=0.14, breaths_per_min=13),
        ),
        Person(
            "clara",
            Phenotype(gender=1.0, age=0.90, weight=0.58, height=0.44, muscle=0.40),
            Look(
                skin=(0.68, 0.43, 0.34), hair=(0.55, 0.53, 0.50), shirt=(0.30, 0.12, 0.26),
                trousers=(0.33, 0.30, 0.27), shoes=(0.10, 0.07, 0.05), sleeve=1.8, loose=1.3,
            ),
            Manner(arm_swing=0.65, bounce=0.8, cadence=1.12, stoop_rad=0.07, breaths_per_min=17),
        ),
        Person(
            "david",
            Phenotype(gender=0.0, age=0.70, weight=0.82, height=0.40, muscle=0.50),
            Look(
                skin=(0.58, 0.32, 0.21), hair=(0.06, 0.04, 0.03), shirt=(0.66, 0.66, 0.68),
                trousers=(0.06, 0.08, 0.15), shoes=(0.15, 0.07, 0.03), sleeve=1.85, loose=1.1,
            ),
            Manner(sway=1.4, arm_swing=0.8, toe_out_rad=0.20, breaths_per_min=16),
        ),
        Person(
            "emma",
            Phenotype(gender=1.0, age=0.60, weight=0.34, height=0.50, muscle=0.62),
            Look(
                skin=(0.36, 0.20, 0.13), hair=(0.02, 0.014, 0.01), shirt=(0.70, 0.20, 0.06),
                trousers=(0.04, 0.04, 0.05), shoes=(0.75, 0.75, 0.72), sleeve=0.25, shorts=True,
                hair_m=0.04, loose=0.7,
            ),
            Manner(arm_swing=1.2, bounce=1.25, breaths_per_min=12),
        ),
        Person(
            "felix",
            Phenotype(gender=0.0, age=0.36, weight=0.45, height=0.45, muscle=0.45),
            Look(
                skin=(0.65, 0.38, 0.27), hair=(0.40, 0.24, 0.08), shirt=(0.10, 0.35, 0.12),
                trousers=(0.09, 0.16, 0.32), shoes=(0.55, 0.08, 0.06), shorts=True, loose=0.8,
            ),
            Manner(arm_swing=1.35, bounce=1.5, cadence=1.05, breaths_per_min=18),
        ),
        Person(
            "georg",
            Phenotype(gender=0.0, age=0.95, weight=0.40, height=0.40, muscle=0.35),
            Look(
                skin=(0.62, 0.38, 0.29), hair=(0.62, 0.61, 0.60), shirt=(0.20, 0.25, 0.33),
                trousers=(0.25, 0.20, 0.14), shoes=(0.06, 0.05, 0.04), sleeve=1.85,
            ),
            Manner(arm_swing=0.55, bounce=0.7, cadence=1.15, stoop_rad=0.10, breaths_per_min=17),
        ),
        Person(
            "hana",
            Phenotype(gender=0.98, age=0.68, weight=0.70, height=0.47, muscle=0.45),
            Look(
                skin=(0.48, 0.28, 0.18), hair=(0.015, 0.012, 0.012), shirt=(0.62, 0.50, 0.52),
                trousers=(0.20, 0.05, 0.08), shoes=(0.35, 0.28, 0.20), hair_m=0.06,
            ),
            Manner(sway=1.5, arm_swing=0.9, toe_out_rad=0.05, breaths_per_min=16),
        ),
        Person(
            "ivan",
            Phenotype(gender=0.0, age=0.64, weight=0.52, height=0.47, muscle=0.62),
            Look(
                skin=(0.60, 0.35, 0.25), hair=(0.10, 0.05, 0.02), shirt=(0.85, 0.30, 0.02),
                trousers=(0.03, 0.05, 0.12), shoes=(0.12, 0.09, 0.06), sleeve=1.85, loose=1.4,
            ),
            Manner(arm_swing=0.9, toe_out_rad=0.16, cadence=0.94, breaths_per_min=14),
        ),
    )
}  # fmt: skip
