# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds a human body in bones whose names say nothing: by hierarchy, symmetry and proportions.

Two legs and two arms are mirror images that branch off a spine; in the rest pose the spine is
upright, the legs are straight below it and the arms do not reach the ground. Lengths are compared
with those of Drillis and Contini (1966) relative to stature, within wide limits: children and
cartoons are people too, four-legged animals and machines are not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from .limbs import Bone, Pair, Point, mirrored_limbs

#: Statures of people [m].
_STATURE_M = (0.5, 2.5)
#: Of the stature: height of the hip above the ankle, upper arm with forearm, half the breadth of
#: the shoulders, and height of the skull's base above the shoulders.
_HIP, _ARM, _SHOULDER, _SKULL = 0.49, 0.32, 0.12, 0.09
#: A hip is this far from the middle, of the length of the leg.
_ASIDE = 0.08
#: So many bones go on from a hand, if it has fingers.
_FINGERS = 3
#: Of the stature, between shoulders and hip: its limits; and how much of it the spine may lean.
_SPINE, _LEAN = (0.15, 0.5), 0.5
#: Nearest that a hand or finger is to the ankles' height, of the stature.
_HANDS_UP = 0.12

_Joints = tuple[Point, Point, Point]
_Choices = Iterator[tuple[float, _Joints]]


@dataclass(frozen=True)
class Landmarks:
    """Which bones a body hangs on."""

    limbs: dict[str, tuple[str, float]]
    """Bone, and position along it from head 0 to tail 1, of each joint of arms and legs."""
    head: str
    neck: str | None = None
    pelvis: str | None = None
    skull: float = 0.5
    """Position of the middle of the skull along the head's bone."""


@dataclass(frozen=True)
class _Figure:
    """Arms and legs that fit a human, measured."""

    legs: Pair
    arms: Pair
    leg: list[_Joints]
    """Hip, knee and ankle of each leg."""
    arm: list[_Joints]
    """Shoulder, elbow and wrist of each arm."""
    up: np.ndarray  # [3]
    stature: float
    """As the legs tell it [m]."""

    @property
    def hip(self) -> np.ndarray:
        """Place [3] between the hips."""
        return np.mean([points[0].place for points in self.leg], axis=0)

    @property
    def shoulder(self) -> np.ndarray:
        """Place [3] between the shoulders."""
        return np.mean([points[0].place for points in self.arm], axis=0)

    @property
    def upright(self) -> bool:
        """Whether the spine stands on the legs, and no hand does on the ground."""
        spine = self.shoulder - self.hip
        rise = float(spine @ self.up)
        lean = float(np.linalg.norm(spine - rise * self.up))
        ankle = min(float(points[2].place @ self.up) for points in self.leg)
        hand = min(float(point.place @ self.up) for limb in self.arms.limbs for point in limb[:-1])
        low, high = (share * self.stature for share in _SPINE)
        return low < rise < high and lean < _LEAN * rise and hand - ankle > _HANDS_UP * self.stature

    @property
    def left_is_first(self) -> bool:
        """Whether the first leg is the left one: by names, else by where feet or knees point."""
        lateral = self.legs.lateral
        for pair in (self.legs, self.arms):
            named = pair.left_is_along(lateral)
            if named is not None:
                return named
        # Whoever looks along `ahead` has the first leg on the left.
        ahead = np.cross(lateral, self.up)
        ends = zip(self.legs.limbs, self.leg, strict=True)
        feet = sum(float((limb[-1].place - points[2].place) @ ahead) for limb, points in ends)
        if abs(feet) > 0.05 * self.legs.length:
            return feet > 0.0
        bends = [2 * knee.place - hip.place - ankle.place for hip, knee, ankle in self.leg]
        knees = sum(float(bend @ ahead) for bend in bends)
        # Blender's figures look along -y, and so do those that it imports.
        return knees > 0.0 if abs(knees) > 0.01 * self.legs.length else bool(ahead[1] < 0.0)


def find_body(bones: Iterable[Bone], ups: Iterable[np.ndarray]) -> Landmarks | None:
    """The body in some bones; None where they are nobody's.

    Args:
        bones: Bones in their rest pose.
        ups: Directions [3] that may be up, the likeliest first.
    """
    known = {bone.name: bone for bone in bones}
    pairs = mirrored_limbs(known.values())
    for up, legs, arms in product(ups, pairs, pairs):
        if arms.parent == legs.parent or arms.bones & legs.bones:
            continue
        figure = _figure(legs, arms, up)
        head = None if figure is None else _head(known, figure)
        if figure is not None and head is not None:
            return _landmarks(known, figure, head)
    return None


def _figure(legs: Pair, arms: Pair, up: np.ndarray) -> _Figure | None:
    """Legs and arms as those of a human; None if they are not."""
    if abs(legs.lateral @ up) > 0.3 or abs(legs.lateral @ arms.lateral) < 0.9:
        return None
    leg = [joints for limb in legs.limbs if (joints := _cheapest(_leg_choices(limb, legs, up)))]
    if len(leg) < 2:
        return None
    hip, ankle = (np.mean([points[at].place for points in leg], axis=0) for at in (0, 2))
    stature = float((hip - ankle) @ up) / _HIP
    if not _STATURE_M[0] <= stature <= _STATURE_M[1]:
        return None
    choices = (_arm_choices(limb, legs, stature) for limb in arms.limbs)
    arm = [joints for option in choices if (joints := _cheapest(option))]
    if len(arm) < 2:
        return None
    figure = _Figure(legs, arms, leg, arm, up, stature)
    return figure if figure.upright else None


def _cheapest(choices: _Choices) -> _Joints | None:
    best = min(choices, key=lambda option: option[0], default=None)
    return None if best is None else best[1]


def _lengths(joints: _Joints) -> tuple[float, float]:
    """Of the two bones between three joints [m]."""
    a, b, c = (point.place for point in joints)
    return float(np.linalg.norm(b - a)), float(np.linalg.norm(c - b))


def _leg_choices(limb: list[Point], legs: Pair, up: np.ndarray) -> _Choices:
    """Hip, knee and ankle on a limb: two bones of about one length, straight down."""
    top = max(float(point.place @ up) for point in limb[:-1])
    ahead = np.cross(legs.lateral, up)
    for joints in combinations(limb, 3):
        thigh, shin = _lengths(joints)
        drop, length = joints[0].place - joints[2].place, thigh + shin
        if min(thigh, shin) < 1e-6 or not 0.6 < thigh / shin < 1.7 or drop @ up < 0.8 * length:
            continue
        # Of a long foot the toes are as likely by length, but they lie ahead.
        cost = abs(np.log(thigh / shin)) + 3.0 * abs(float(drop @ ahead)) / length
        sideways = abs(float((joints[0].place - legs.middle) @ legs.lateral)) / length
        cost += 4.0 * max(0.0, _ASIDE - sideways)
        yield cost + 2.0 * (top - float(joints[0].place @ up)) / length, joints


def _arm_choices(limb: list[Point], legs: Pair, stature: float) -> _Choices:
    """Shoulder, elbow and wrist on a limb: as long and as far out as those of a human."""
    hands = [point for point in limb if point.fingers >= _FINGERS]
    for joints in combinations(limb, 3):
        if hands and joints[2] is not hands[0]:
            continue
        upper, fore = _lengths(joints)
        length = upper + fore
        if min(upper, fore) < 1e-6 or not 0.6 < upper / fore < 1.8:
            continue
        if not 0.2 < length / stature < 0.5:
            continue
        if np.linalg.norm(joints[2].place - joints[0].place) < 0.7 * length:
            continue
        out = abs(float((joints[0].place - legs.middle) @ legs.lateral)) / stature
        cost = abs(np.log(upper / fore / 1.15)) + 4.0 * abs(length / stature - _ARM)
        yield cost + 6.0 * abs(out - _SHOULDER), joints


def _head(known: dict[str, Bone], figure: _Figure) -> Bone | None:
    """The bone that begins where a skull does, between the sides; None without one."""
    taken = figure.legs.bones | figure.arms.bones
    root, shoulder = _root(known, figure.arms.parent), figure.shoulder
    wanted = shoulder + _SKULL * figure.stature * figure.up
    best, least = None, 0.12 * figure.stature
    for bone in known.values():
        above = float((bone.head - shoulder) @ figure.up)
        sideways = abs(float((bone.head - figure.legs.middle) @ figure.legs.lateral))
        if bone.name in taken or above < 0.01 * figure.stature or sideways > 0.04 * figure.stature:
            continue
        off = float(np.linalg.norm(bone.head - wanted))
        if off < least and _root(known, bone.name) == root:
            best, least = bone, off
    return best


def _root(known: dict[str, Bone], name: str) -> str:
    while known[name].parent:
        name = known[name].parent
    return name


def _landmarks(known: dict[str, Bone], figure: _Figure, head: Bone) -> Landmarks:
    """Names what was found."""
    left_is_first = figure.left_is_first
    same_order = bool(figure.arms.lateral @ figure.legs.lateral > 0.0)
    limbs: dict[str, tuple[str, float]] = {}
    for names, both, in_order in (
        (("hip", "knee", "ankle"), figure.leg, left_is_first),
        (("shoulder", "elbow", "wrist"), figure.arm, left_is_first == same_order),
    ):
        for side, joints in zip(("left", "right"), both if in_order else both[::-1], strict=True):
            rows = zip(names, joints, strict=True)
            limbs |= {f"{side}_{name}": (point.bone, point.along) for name, point in rows}
    neck, pelvis, line = None, known[figure.legs.parent], head
    while line.parent:
        line = known[line.parent]
        # Necks may have several bones; the lowest that is not below the shoulders counts.
        if float((line.head - figure.shoulder) @ figure.up) < -0.03 * figure.stature:
            break
        neck = line
    near = float(np.linalg.norm(pelvis.head - figure.hip)) < 0.15 * figure.stature
    # Tails of imported bones may point anywhere.
    rise = float((head.tail - head.head) @ figure.up) / figure.stature
    return Landmarks(
        limbs,
        head.name,
        neck.name if neck else None,
        pelvis.name if near else None,
        0.5 if 0.04 < rise < 0.3 else 0.0,
    )
