# SPDX-License-Identifier: GPL-3.0-or-later
"""The naked body of a person as arrays, from the parametric body model anny."""

from __future__ import annotations

import functools
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Phenotype:
    """What a body is like, in anny's own parameters from 0 to 1; the default is a man of 1.7 m."""

    gender: float = 0.0
    """0 male, 1 female."""
    age: float = 0.62
    """0 newborn, 1/3 child, 2/3 young adult, 1 old."""
    muscle: float = 0.56
    """0 none, 1 a body builder's."""
    weight: float = 0.46
    """0 thin, 1 heavy, at the same height."""
    height: float = 0.38
    """0 short, 1 tall, for the age and gender."""
    proportions: float = 0.7
    """0 uncommon, 1 ideal."""


@dataclass(frozen=True)
class Body:
    """A body that stands on z = 0, looks along -y, its left side at +x."""

    vertices: np.ndarray
    """Vertices [m], shape (V, 3)."""
    faces: np.ndarray
    """Triangles, shape (T, 3)."""
    bones: tuple[str, ...]
    """Names of the bones, parents before children."""
    parents: tuple[int, ...]
    """Index of each bone's parent, -1 for the root."""
    heads: np.ndarray
    """Where each bone starts [m], shape (B, 3)."""
    weights: np.ndarray
    """Skin weights, rows sum to 1, shape (V, B)."""

    def head(self, bone: str) -> np.ndarray:
        """Where a bone starts [m], shape (3,)."""
        return self.heads[self.bones.index(bone)]

    def share(self, *prefixes: str) -> np.ndarray:
        """Summed weights [V] of all bones whose name starts with one of `prefixes`."""
        columns = [index for index, name in enumerate(self.bones) if name.startswith(prefixes)]
        return self.weights[:, columns].sum(axis=1)


def _keeps(bone: str) -> bool:
    """Toes move as one and the palm as the hand; eyes follow the head."""
    if bone.startswith(("toe", "metacarpal", "eye")):
        return bone.startswith("toe1-1")
    return True


def _heir(bone: str, parent: str) -> str:
    """Bone that takes over the skin of a bone that is left out."""
    return f"toe1-1{bone[-2:]}" if bone.startswith("toe") else parent


@functools.cache
def _model() -> Any:
    import anny
    from anny.models.model_data import TopologyConfig

    return anny.Anny(topology=TopologyConfig(base_mesh="notoes", eyes=False, tongue=False))


def load_body(phenotype: Phenotype | None = None) -> Body:
    """Builds a body; the first call on a machine takes over a minute, later ones seconds."""
    import torch

    wanted = asdict(phenotype or Phenotype())
    model = _model()
    output = model(phenotype_kwargs={name: torch.tensor([wanted[name]]) for name in wanted})
    vertices = output["rest_vertices"][0].double().numpy()
    heads = output["rest_bone_heads"][0].double().numpy()
    weights = np.zeros((len(vertices), len(model.bone_labels)))
    rows = np.arange(len(vertices))[:, None]
    np.add.at(
        weights,
        (rows, model.vertex_bone_indices.numpy()),
        model.vertex_bone_weights.double().numpy(),
    )
    shift = np.array([0.0, 0.0, vertices[:, 2].min()])
    body = Body(
        vertices - shift,
        model.faces.numpy().astype(np.int64),
        tuple(model.bone_labels),
        tuple(int(parent) for parent in model.bone_parents),
        heads - shift,
        weights / weights.sum(axis=1, keepdims=True),
    )
    return _simplify(_largest_part(body))


def _largest_part(body: Body) -> Body:
    """Keeps the largest connected part: the skin without loose pieces inside."""
    label = np.arange(len(body.vertices))
    while True:
        low = label[body.faces].min(axis=1)
        before = label.copy()
        np.minimum.at(label, body.faces.ravel(), np.repeat(low, 3))
        label = label[label]
        if np.array_equal(label, before):
            break
    names, counts = np.unique(label, return_counts=True)
    kept = label == names[counts.argmax()]
    number = np.cumsum(kept) - 1
    faces = number[body.faces[kept[body.faces].all(axis=1)]]
    return Body(
        body.vertices[kept], faces, body.bones, body.parents, body.heads, body.weights[kept]
    )


def _simplify(body: Body) -> Body:
    """Leaves out bones nobody animates and hands their skin to a neighbour."""
    kept = [name for name in body.bones if _keeps(name)]
    weights = np.zeros((len(body.vertices), len(kept)))
    parents = []
    for index, name in enumerate(body.bones):
        target = name
        while target not in kept:
            target = _heir(target, body.bones[body.parents[body.bones.index(target)]])
        weights[:, kept.index(target)] += body.weights[:, index]
        if name in kept:
            above = body.parents[index]
            while above >= 0 and body.bones[above] not in kept:
                above = body.parents[above]
            parents.append(kept.index(body.bones[above]) if above >= 0 else -1)
    heads = np.stack([body.head(name) for name in kept])
    return Body(body.vertices, body.faces, tuple(kept), tuple(parents), heads, weights)
