# SPDX-License-Identifier: Apache-2.0
"""The space of human shapes: bodies from a few coefficients, and random people in clothes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from rfgs_core.arrays import Shape, load_arrays
from rfgs_core.articulated.body import Body
from rfgs_core.articulated.bones import BONES
from rfgs_core.articulated.surface import vertex_normals
from rfgs_core.errors import RfgsError, RfgsFormatError

#: Written by `python -m blender_scenes bodies`.
SHAPE_SPACE = Path(__file__).with_name("people.npz")
_REMEDY = "install the package again"
_SHAPES: dict[str, Shape] = {
    "mean": ("point", 3),
    "components": ("coefficient", "point", 3),
    "faces": ("face", 3),
    "bone": ("vertex", 4),
    "weight": ("vertex", 4),
    **{f"{age}_middle": ("coefficient",) for age in ("adults", "children")},
    **{f"{age}_spread": ("coefficient", "coefficient") for age in ("adults", "children")},
}
_TYPES = {name: "f2 f4" for name in _SHAPES} | {"faces": "i2", "bone": "u1"}
#: Draws farther out than this are drawn again [standard deviations].
_FARTHEST = 2.2
#: Thickest that clothes and hair are drawn [m].
_CLOTHES_M, _HAIR_M = 0.03, 0.03
#: Bones under each piece of clothes that stands off the skin by a thickness of its own.
_REGIONS = {
    "torso": ("pelvis", "spine", "clavicle"),
    "arms": ("upperarm", "lowerarm"),
    "legs": ("upperleg", "lowerleg"),
}


@dataclass(frozen=True)
class ShapeSpace:
    """Mean adult and what differs between people, as `blender_scenes` wrote it from anny."""

    mean: np.ndarray
    """Vertices and then heads of the bones of the mean adult [m], shape [V + B, 3]."""
    components: np.ndarray
    """What one standard deviation of each coefficient adds [m], shape [K, V + B, 3]."""
    faces: np.ndarray
    """Triangles, int32, shape [F, 3]."""
    weights: tuple[np.ndarray, np.ndarray]
    """Index and weight of the bones that hold each vertex, [V, 4] each."""
    drawn: dict[str, tuple[np.ndarray, np.ndarray]]
    """Mean [K] and triangular root of the covariance [K, K] of coefficients: adults, children."""

    def body(self, coefficients: np.ndarray) -> Body:
        """The naked body of some coefficients.

        Args:
            coefficients: How far from the mean adult [standard deviations], shape [K] or fewer.
        """
        points = self._points(coefficients)
        count = len(points) - len(BONES)
        return self._standing(points[:count], points[count:])

    def heads(self, coefficients: np.ndarray) -> np.ndarray:
        """Heads of the bones alone [B, 3] in metres, not yet standing on the floor."""
        return self._points(coefficients)[-len(BONES) :]

    def coefficients(self, rng: np.random.Generator, child: bool = False) -> np.ndarray:
        """Random coefficients [K] of a plausible adult or child."""
        middle, spread = self.drawn["children" if child else "adults"]
        draw = rng.standard_normal(len(middle))
        while np.abs(draw).max() > _FARTHEST:
            far = np.abs(draw) > _FARTHEST
            draw[far] = rng.standard_normal(int(far.sum()))
        return middle + spread @ draw

    def random(self, rng: np.random.Generator, child: bool = False) -> Body:
        """A random person in random clothes, with random hair.

        Args:
            rng: Where chance comes from.
            child: A child of school age instead of an adult.
        """
        body = self.body(self.coefficients(rng, child))
        # Most clothes are thin; children's are not thinner.
        thickness = {name: _CLOTHES_M * rng.beta(1.3, 2.0) for name in _REGIONS}
        return self.dressed(body, thickness, _HAIR_M * rng.beta(1.5, 1.5))

    def dressed(self, body: Body, thickness: dict[str, float], hair_m: float) -> Body:
        """The body with its skin pushed outwards.

        Args:
            body: A naked body of this space.
            thickness: How far clothes stand off the skin [m], of `torso`, `arms` and `legs`.
            hair_m: The same of hair [m].
        """
        push = hair_m * self._hair
        for name, thick_m in thickness.items():
            push = push + thick_m * self._share(name)
        normals = vertex_normals(body.vertices, body.faces)
        return self._standing(body.vertices + push[:, None] * normals, body.heads)

    def _points(self, coefficients: np.ndarray) -> np.ndarray:
        given = np.asarray(coefficients, np.float64)
        if given.ndim != 1 or len(given) > len(self.components) or not np.isfinite(given).all():
            raise RfgsError(
                f"coefficients of a body: expected at most {len(self.components)} finite numbers, "
                f"got an array of shape {list(given.shape)}"
            )
        return self.mean + np.tensordot(given, self.components[: len(given)], axes=1)

    def _standing(self, vertices: np.ndarray, heads: np.ndarray) -> Body:
        shift = np.array([0.0, 0.0, -vertices[:, 2].min()])
        return Body(vertices + shift, self.faces, heads + shift, self.weights)

    def _share(self, region: str) -> np.ndarray:
        """How far each vertex belongs to a region of clothes, from 0 to 1, shape [V]."""
        rows = [i for i, name in enumerate(BONES) if name.startswith(_REGIONS[region])]
        bone, weight = self.weights
        return np.where(np.isin(bone, rows), weight, 0.0).sum(axis=1)

    @cached_property
    def _hair(self) -> np.ndarray:
        """How far each vertex belongs to the hair, from 0 to 1, shape [V].

        Crown and back of the head: what is high, or farther back the lower it is.
        """
        bone, weight = self.weights
        skull = np.where(bone == BONES.index("head"), weight, 0.0).sum(axis=1)
        own = self.mean[: len(skull)]
        low, high = own[skull > 0.9].min(axis=0), own[skull > 0.9].max(axis=0)
        share = (own - low) / (high - low)
        return skull * np.clip((share[:, 2] - 0.8 * share[:, 0] - 0.35) / 0.15, 0.0, 1.0)


@cache
def people() -> ShapeSpace:
    """The shape space that comes with the package, read once."""
    return read_shape_space(SHAPE_SPACE)


def read_shape_space(file: Path) -> ShapeSpace:
    """Reads a shape space.

    Raises:
        RfgsError: There is no such file.
        RfgsFormatError: It is damaged.
    """
    arrays = load_arrays(file, _REMEDY, _SHAPES, types=_TYPES)
    count = len(arrays["bone"])
    exact = {name: values.astype(np.float64) for name, values in arrays.items()}
    weight = exact["weight"]
    if len(arrays["mean"]) != count + len(BONES):
        raise RfgsFormatError(f"{file}: mean: expected a point for each vertex and bone; {_REMEDY}")
    for name, most in (("faces", count), ("bone", len(BONES))):
        if not 0 <= arrays[name].min() <= arrays[name].max() < most:
            raise RfgsFormatError(f"{file}: {name}: expected indices below {most}; {_REMEDY}")
    if weight.min() < 0.0 or not weight.sum(axis=1).min() > 0.0:
        raise RfgsFormatError(f"{file}: weight: expected bones that hold each vertex; {_REMEDY}")
    spread = {
        age: (exact[f"{age}_middle"], exact[f"{age}_spread"]) for age in ("adults", "children")
    }
    return ShapeSpace(
        exact["mean"],
        exact["components"],
        arrays["faces"].astype(np.int32),
        (arrays["bone"].astype(np.int64), weight / weight.sum(axis=1, keepdims=True)),
        spread,
    )
