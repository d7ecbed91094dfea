# SPDX-License-Identifier: GPL-3.0-or-later
"""Limbs among bones: chains that are mirror images of each other in the rest pose."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

#: Mirrored points may differ by this share of a limb's length.
_MIRROR = 0.12
#: Words in the names of bones that tell their side.
_SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


@dataclass(frozen=True)
class Bone:
    """One bone in its rest pose."""

    name: str
    parent: str
    """Name of its parent; empty for a root."""
    head: np.ndarray  # [3]
    """Where it begins [m]."""
    tail: np.ndarray  # [3]
    """Where it ends [m]; importers make this up for bones without children."""


@dataclass(frozen=True)
class Point:
    """A place on a limb: the head of one of its bones, or the tail of the last."""

    bone: str
    along: float
    """0 at the bone's head, 1 at its tail."""
    place: np.ndarray  # [3]
    fingers: int = 0
    """How many bones go on from this one, where it is the bone's head."""


@dataclass(frozen=True)
class Pair:
    """Two limbs that are mirror images, and hang on one bone."""

    parent: str
    """Name of that bone."""
    limbs: tuple[list[Point], list[Point]]
    lateral: np.ndarray  # [3]
    """Unit vector from the second limb to the first."""
    middle: np.ndarray  # [3]
    """A place between them."""
    length: float
    """Of one limb, from head to head [m]."""

    @property
    def bones(self) -> set[str]:
        """Names of the bones of both."""
        return {point.bone for limb in self.limbs for point in limb}

    def left_is_along(self, lateral: np.ndarray) -> bool | None:
        """Whether left is that way, by the names of the bones; None where they do not say."""
        sides = [_side(limb) for limb in self.limbs]
        if set(sides) != {"left", "right"}:
            return None
        return (sides[0] == "left") == bool(self.lateral @ lateral > 0.0)


def mirrored_limbs(bones: Iterable[Bone]) -> list[Pair]:
    """All pairs of limbs, the longest first."""
    known = {bone.name: bone for bone in bones}
    children: dict[str, list[str]] = {}
    for bone in known.values():
        if bone.parent:
            children.setdefault(bone.parent, []).append(bone.name)
    reach: dict[str, float] = {}
    for name in known:
        _measure(known, children, name, reach)
    found = []
    for parent, names in children.items():
        limbs = [_limb(known, children, name, reach) for name in names]
        found += [pair for two in combinations(limbs, 2) for pair in _mirrored(parent, *two)]
    return sorted(found, key=lambda pair: -pair.length)


def _step(known: dict[str, Bone], bone: str, child: str) -> float:
    return float(np.linalg.norm(known[child].head - known[bone].head))


def _measure(
    known: dict[str, Bone], children: dict[str, list[str]], name: str, reach: dict[str, float]
) -> None:
    """Writes into `reach` how far the heads of bones go on beyond that of one [m]."""
    # Without recursion: a tail may have more bones than Python has frames.
    todo = [name]
    while todo:
        top = todo[-1]
        missing = [child for child in children.get(top, ()) if child not in reach]
        if top not in reach and missing:
            todo += missing
            continue
        if top not in reach:
            below = (_step(known, top, child) + reach[child] for child in children.get(top, ()))
            reach[top] = max(below, default=0.0)
        todo.pop()


def _limb(
    known: dict[str, Bone], children: dict[str, list[str]], first: str, reach: dict[str, float]
) -> list[Point]:
    """From a bone along those children that lead furthest, to the last one's tail."""
    name = first
    points = [Point(name, 0.0, known[name].head, len(children.get(name, ())))]
    while children.get(name):
        above = name
        name = max(children[name], key=lambda child: _step(known, above, child) + reach[child])
        points.append(Point(name, 0.0, known[name].head, len(children.get(name, ()))))
    return [*points, Point(name, 1.0, known[name].tail)]


def _mirrored(parent: str, one: list[Point], other: list[Point]) -> Iterator[Pair]:
    """Two limbs as a pair if one plane mirrors each head of one onto its twin."""
    a, b = (np.array([point.place for point in limb[:-1]]) for limb in (one, other))
    if a.shape != b.shape or len(a) < 2:
        return
    length = float(np.linalg.norm(np.diff(a, axis=0), axis=1).sum())
    across = (a - b).sum(axis=0)
    distance = float(np.linalg.norm(across))
    if min(length, distance) < 1e-6:
        return
    lateral, middle = across / distance, 0.5 * (a + b).mean(axis=0)
    image = a - 2.0 * ((a - middle) @ lateral)[:, None] * lateral
    if np.linalg.norm(image - b, axis=1).max() < _MIRROR * length:
        yield Pair(parent, (one, other), lateral, middle, length)


def _side(limb: list[Point]) -> str:
    """Side that the names of a limb's bones agree on; empty where they do not."""
    words = [word.lower() for point in limb for word in _WORDS.findall(point.bone)]
    found = {_SIDES[word] for word in words if word in _SIDES}
    return found.pop() if len(found) == 1 else ""
