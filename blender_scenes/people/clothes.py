# SPDX-License-Identifier: GPL-3.0-or-later
"""Clothes and hair that replace skin: the body's own surface, reshaped and coloured by region.

A second shell over the skin would be lost to the ray tracer, which needs a centimetre between
sheets; so a shirt is the torso's surface, smoothed and pushed outwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blender_scenes.people.body import Body

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Look:
    """Clothes and colours of one person; colours are linear RGB, None the ordinary ones."""

    skin: Colour | None = None
    """Skin."""
    hair: Colour | None = None
    """Hair."""
    shirt: Colour | None = None
    """Shirt."""
    trousers: Colour | None = None
    """Trousers."""
    shoes: Colour | None = None
    """Shoes."""
    sleeve: float = 0.72
    """Length of the sleeves, as a share of the upper arm; 1.9 reaches the wrists."""
    shorts: bool = False
    """Trousers end above the knees."""
    hair_m: float = 0.0
    """How much lower than short hair the hair falls [m]."""
    loose: float = 1.0
    """How far clothes stand off the skin, as a share of the ordinary."""


LIMBS = ("head", "torso", "arm", "hand", "leg", "foot")

_BONES_OF_LIMB = {
    "head": ("head", "neck02", "neck03"),
    "torso": ("spine", "clavicle", "root", "pelvis", "neck01", "shoulder"),
    "arm": ("upperarm", "lowerarm"),
    "hand": ("wrist", "finger"),
    "leg": ("upperleg", "lowerleg"),
    "foot": ("foot", "toe"),
}


@dataclass(frozen=True)
class Cut:
    """A plane that parts two materials on some limbs."""

    limbs: tuple[str, ...]
    """Limbs it applies to."""
    side: int
    """1 only where x > 0, -1 only where x < 0, 0 everywhere."""
    point: np.ndarray
    """A point on the plane [m]."""
    normal: np.ndarray
    """Its normal; `beyond` is on this side."""

    def beyond(self, points: np.ndarray, limbs: np.ndarray) -> np.ndarray:
        """Whether each of `points` [N, 3] on `limbs` [N] lies beyond the plane."""
        applies = np.isin(limbs, [LIMBS.index(limb) for limb in self.limbs])
        if self.side:
            applies &= points[:, 0] * self.side > 0
        return applies & ((points - self.point) @ self.normal > 0)


def limb_weights(body: Body) -> np.ndarray:
    """Share of each limb in each vertex, shape (V, 6)."""
    return np.stack([body.share(*_BONES_OF_LIMB[limb]) for limb in LIMBS], axis=1)


def cuts(body: Body, look: Look) -> dict[str, Cut]:
    """The borders between skin, hair and clothes, by name."""
    up = np.array([0.0, 0.0, 1.0])
    head, neck = body.head("head"), body.head("neck01")
    made = {
        "hairline": Cut(
            ("head",), 0, head + np.array([0.0, -0.10, 0.104]), np.array([0.0, 0.355, 0.935])
        ),
        "behind_ears": Cut(
            ("head",), 0, head + np.array([0.0, 0.024, 0.0]), np.array([0.0, 1.0, 0.0])
        ),
        "nape": Cut(
            ("head",),
            0,
            head + np.array([0.0, 0.05, -0.005 - look.hair_m]),
            np.array([0.0, -0.2, 0.98]),
        ),
        "collar": Cut(
            ("torso", "head"), 0, neck + np.array([0.0, -0.01, 0.002]), np.array([0.0, -0.42, 0.91])
        ),
        "waist": Cut(("torso", "leg"), 0, body.head("spine04") + np.array([0.0, 0.0, -0.015]), -up),
        "sole": Cut(("foot",), 0, np.array([0.0, 0.0, 0.024]), -up),
    }
    for name, side in (("L", 1), ("R", -1)):
        made[f"sleeve.{name}"] = _sleeve(body, name, side, look.sleeve)
        if look.shorts:
            hip, knee = body.head(f"upperleg01.{name}"), body.head(f"lowerleg01.{name}")
            made[f"hem.{name}"] = Cut(("leg",), side, hip + 0.84 * (knee - hip), -up)
        ankle = body.head(f"foot.{name}")
        made[f"shoe.{name}"] = Cut(("leg", "foot"), side, ankle + np.array([0.0, 0.0, 0.018]), -up)
    return made


def _sleeve(body: Body, name: str, side: int, length: float) -> Cut:
    """Border of a sleeve that is `length` upper arms long."""
    joints = [body.head(f"{bone}.{name}") for bone in ("upperarm01", "lowerarm01", "wrist")]
    start, end = joints[:2] if length <= 1 else joints[1:]
    along = end - start
    share = length if length <= 1 else length - 1
    return Cut(("arm",), side, start + share * along, along / np.linalg.norm(along))


def surface_of(points: np.ndarray, limbs: np.ndarray, borders: dict[str, Cut]) -> np.ndarray:
    """Name of the surface at each of `points` [N, 3] in the rest pose.

    Args:
        points: Points on the skin [m], shape (N, 3).
        limbs: Index in `LIMBS` of the limb each lies on, shape (N,).
        borders: Result of `cuts`.
    """
    beyond = {name: cut.beyond(points, limbs) for name, cut in borders.items()}
    torso, arm, leg, foot = (limbs == LIMBS.index(n) for n in ("torso", "arm", "leg", "foot"))
    shoe = foot | leg
    shoe &= beyond["shoe.L"] | beyond["shoe.R"]
    bare = arm & (beyond["sleeve.L"] | beyond["sleeve.R"])
    hair = beyond["hairline"] | (beyond["behind_ears"] & beyond["nape"])
    names = np.full(len(points), "skin", dtype=object)
    names[(torso | (limbs == 0)) & ~beyond["collar"]] = "shirt"
    names[hair] = "hair"
    names[arm & ~bare] = "shirt"
    names[((torso & beyond["waist"]) | leg | foot) & ~shoe] = "trousers"
    if "hem.L" in beyond:
        names[leg & ~shoe & (beyond["hem.L"] | beyond["hem.R"])] = "skin"
    names[shoe] = "shoes"
    names[shoe & beyond["sole"]] = "soles"
    return names.astype(str)


def dress(body: Body, look: Look | None = None) -> Body:
    """Smooths the skin under clothes and pushes it outwards by the cloth's thickness."""
    look = look or Look()
    limbs = limb_weights(body)
    surface = surface_of(body.vertices, limbs.argmax(axis=1), cuts(body, look))
    neighbours = _neighbours(body.faces, len(body.vertices))
    vertices = body.vertices
    for name, rounds, push, hem in (
        ("shirt", 22, 0.014, 0.35),
        ("trousers", 26, 0.014, 0.7),
        ("shoes", 8, 0.008, 0.6),
        ("hair", 12, 0.019, 0.3),
    ):
        inside = (surface == name) | ((name == "shoes") & (surface == "soles"))
        # Fade over a few rings of vertices, so that hems have no spikes.
        mask = inside.astype(np.float64)
        for _ in range(3):
            mask = np.minimum(mask, neighbours(mask))
        for _ in range(rounds):
            vertices = vertices + 0.6 * mask[:, None] * (neighbours(vertices) - vertices)
        thickness = push * np.where(inside, hem + (1 - hem) * mask, 0.0)
        if name in ("shirt", "trousers"):
            thickness = thickness * look.loose
        if name == "trousers":
            thickness = thickness * _flare(body)
        vertices = vertices + thickness[:, None] * _normals(vertices, body.faces)
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.0)
    return replace(body, vertices=vertices)


def _flare(body: Body) -> np.ndarray:
    """How much wider trousers hang towards the ankle, where legs are thinnest, shape (V,)."""
    knee = body.head("lowerleg01.L")[2]
    return 1.0 + 1.1 * np.clip(1 - body.vertices[:, 2] / (1.15 * knee), 0.0, 1.0)


def _neighbours(faces: np.ndarray, count: int) -> Callable[[np.ndarray], np.ndarray]:
    """A function that averages a vertex quantity over each vertex's neighbours."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    degree = np.bincount(pairs[:, 0], minlength=count).astype(np.float64)

    def average(values: np.ndarray) -> np.ndarray:
        total = np.zeros_like(values)
        np.add.at(total, pairs[:, 0], values[pairs[:, 1]])
        return total / (degree[:, None] if values.ndim == 2 else degree)

    return average


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit vertex normals, shape (V, 3), weighted by area."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    flat = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], flat)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
