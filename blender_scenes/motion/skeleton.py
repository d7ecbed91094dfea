# SPDX-License-Identifier: GPL-3.0-or-later
"""The joints of one body at rest, and the poses they take.

Axes of the rest pose: the person looks along -y, left is +x, z is up, the floor is z = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from blender_scenes.motion.rotations import matrices, quaternions, slerp
from blender_scenes.people.body import Body

SIDES = ("L", "R")


@dataclass(frozen=True)
class Pose:
    """Where a body is at one moment."""

    root: np.ndarray
    """Position of the pelvis in the world [m], shape (3,)."""
    turns: Mapping[str, np.ndarray]
    """Rotation from rest to world of bones, (3, 3) each; others keep to their parent."""
    breath: float = 0.0
    """How full the chest is: 0 after breathing out, 1 after breathing in."""


@dataclass(frozen=True)
class Legs:
    """Rest positions of the joints of both legs and of the pelvis [m], left leg first."""

    root: np.ndarray
    """Pelvis, shape (3,)."""
    hip: np.ndarray
    """Hips, shape (2, 3)."""
    knee: np.ndarray
    """Knees, shape (2, 3)."""
    ankle: np.ndarray
    """Ankles, shape (2, 3)."""
    toe: np.ndarray
    """Joints between foot and toes, shape (2, 3)."""
    heel: np.ndarray
    """Lowest points of the heels, on z = 0, shape (2, 3)."""


@dataclass(frozen=True)
class Surface:
    """A few points of the skin, each carried by one bone: enough to find what touches what."""

    points: np.ndarray
    """Where they are in the rest pose [m], shape (N, 3)."""
    bone: np.ndarray
    """Number of the bone that carries each, shape (N,)."""


@dataclass(frozen=True)
class Skeleton:
    """Bones of a body at rest."""

    bones: tuple[str, ...]
    """Names, parents before children."""
    parents: tuple[int, ...]
    """Index of each bone's parent, -1 for the root."""
    heads: np.ndarray
    """Where each bone starts [m], shape (B, 3)."""
    heel: np.ndarray
    """Lowest points of the heels, on z = 0, left first [m], shape (2, 3)."""
    surface: Surface
    """Points of the skin."""
    index: dict[str, int] = field(init=False, compare=False, repr=False)
    """Number of each bone."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "index", {name: i for i, name in enumerate(self.bones)})

    def head(self, bone: str) -> np.ndarray:
        """Where a bone starts at rest [m], shape (3,)."""
        return self.heads[self.index[bone]]

    def pair(self, bone: str) -> np.ndarray:
        """Rest positions of a left and a right bone [m], shape (2, 3)."""
        return np.stack([self.head(f"{bone}.{side}") for side in SIDES])

    @cached_property
    def legs(self) -> Legs:
        """Joints of both legs at rest."""
        return Legs(
            root=self.head("root"),
            hip=self.pair("upperleg01"),
            knee=self.pair("lowerleg01"),
            ankle=self.pair("foot"),
            toe=self.pair("toe1-1"),
            heel=self.heel,
        )

    def world_turns(self, pose: Pose) -> np.ndarray:
        """Rotations from rest to world of all bones, shape (B, 3, 3)."""
        out = np.zeros((len(self.bones), 3, 3))
        for index, name in enumerate(self.bones):
            parent = self.parents[index]
            above = out[parent] if parent >= 0 else np.eye(3)
            out[index] = pose.turns.get(name, above)
        return out

    def joints(self, pose: Pose) -> np.ndarray:
        """Where every bone starts in the world [m], shape (B, 3)."""
        turns, out = self.world_turns(pose), np.zeros((len(self.bones), 3))
        for index, parent in enumerate(self.parents):
            if parent < 0:
                out[index] = pose.root
            else:
                out[index] = out[parent] + turns[parent] @ (self.heads[index] - self.heads[parent])
        return out

    def touching(self, pose: Pose, *prefixes: str) -> np.ndarray:
        """Where the skin's points are in the world [m], shape (N, 3).

        Args:
            pose: The pose.
            prefixes: Only points of bones whose names start so; none for all.
        """
        turns, joints = self.world_turns(pose), self.joints(pose)
        bone, points = self.surface.bone, self.surface.points
        if prefixes:
            chosen = [self.bones[index].startswith(prefixes) for index in bone]
            bone, points = bone[chosen], points[chosen]
        return joints[bone] + np.einsum("nij,nj->ni", turns[bone], points - self.heads[bone])

    def locals(self, pose: Pose) -> np.ndarray:
        """Rotation of each bone against its parent as unit quaternions, w first, (B, 4)."""
        turns = self.world_turns(pose)
        above = np.stack([turns[p] if p >= 0 else np.eye(3) for p in self.parents])
        return quaternions(np.einsum("bji,bjk->bik", above, turns))

    def posed(self, root: np.ndarray, local: np.ndarray, breath: float = 0.0) -> Pose:
        """The pose with these rotations against the parents, the inverse of `locals`."""
        turns: dict[str, np.ndarray] = {}
        for index, (name, own) in enumerate(zip(self.bones, matrices(local), strict=True)):
            parent = self.parents[index]
            turns[name] = turns[self.bones[parent]] @ own if parent >= 0 else own
        return Pose(np.asarray(root, dtype=np.float64), turns, breath)

    def blend(self, first: Pose, second: Pose, share: float) -> Pose:
        """Between two poses, joint by joint on the shortest arc; `share` 0 gives the first."""
        local = slerp(self.locals(first), self.locals(second), share)
        root = (1 - share) * first.root + share * second.root
        return self.posed(root, local, (1 - share) * first.breath + share * second.breath)


def skeleton_of(body: Body) -> Skeleton:
    """The skeleton of a body."""
    heels = []
    for side, sign in zip(SIDES, (1, -1), strict=True):
        low = (body.vertices[:, 2] < 0.012) & (body.vertices[:, 0] * sign > 0)
        low &= body.share(f"foot.{side}") > 0.5
        rearmost = body.vertices[low][body.vertices[low][:, 1].argmax()]
        heels.append([rearmost[0], rearmost[1] - 0.015, 0.0])
    return Skeleton(body.bones, body.parents, body.heads, np.array(heels), _surface(body))


def _surface(body: Body, per_bone: int = 7) -> Surface:
    """Points far from each other on the skin of every bone, fingers with fewer."""
    main = body.weights.argmax(axis=1)
    points, bones = [], []
    for index, name in enumerate(body.bones):
        skin = body.vertices[main == index]
        if not len(skin):
            continue
        count = min(2 if name.startswith("finger") else per_bone, len(skin))
        chosen = [int(np.linalg.norm(skin - skin.mean(axis=0), axis=1).argmax())]
        while len(chosen) < count:
            gaps = np.linalg.norm(skin[:, None] - skin[chosen], axis=2).min(axis=1)
            chosen.append(int(gaps.argmax()))
        points.append(skin[chosen])
        bones += [index] * count
    return Surface(np.concatenate(points), np.array(bones))
