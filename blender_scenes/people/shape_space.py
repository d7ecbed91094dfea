# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the shape space of `rfgs_core.articulated`: many anny bodies as few coefficients.

The mesh of the mean body is thinned out once; each vertex that is left is a point on a triangle
of anny's mesh, so that it exists on every body. What differs between bodies, vertices and bone
heads together, are sums of principal components.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from blender_scenes.people.body import Body, Phenotype, load_body
from blender_scenes.people.bones import anny_name
from rfgs_core.arrays import save_arrays
from rfgs_core.articulated.bones import BONES

ADULTS, CHILDREN = 136, 24
COMPONENTS = 12
#: Share of anny's triangles that is kept.
DETAIL = 0.245
SEED = 7


def write_shape_space(path: Path) -> str:
    """Writes the shape space; returns a line about it."""
    rng = np.random.default_rng(SEED)
    phenotypes = [adult(rng) for _ in range(ADULTS)] + [child(rng) for _ in range(CHILDREN)]
    bodies = [load_body(phenotype) for phenotype in phenotypes]
    grown = np.arange(len(bodies)) < ADULTS
    mean = np.mean([body.vertices for body in bodies[:ADULTS]], axis=0)
    faces, corners, shares = _thinned(mean, bodies[0].faces)
    points = np.stack([_points(body, corners, shares) for body in bodies])
    arrays, error_m = _components(points, grown)
    bone, weight = _skin(bodies[0], corners, shares)
    skin = {
        "faces": faces.astype(np.int16),
        "bone": bone.astype(np.uint8),
        "weight": weight.astype(np.float16),
    }
    save_arrays(path, {**arrays, **skin}, packed=True)
    return (
        f"{len(bodies)} bodies, {points.shape[1] - len(BONES)} vertices, {len(faces)} triangles, "
        f"{COMPONENTS} components: mean error {1e3 * error_m.mean():.2f} mm, "
        f"worst body {1e3 * error_m.mean(axis=1).max():.2f} mm, "
        f"adults {1e3 * error_m[grown].mean():.2f} mm"
    )


def adult(rng: np.random.Generator) -> Phenotype:
    """A random grown-up; most are clearly women or men, none is a giant or a dwarf."""
    return Phenotype(
        gender=float(np.clip(rng.integers(2) + rng.normal(0.0, 0.12), 0.0, 1.0)),
        age=float(rng.uniform(0.56, 1.0)),
        muscle=float(rng.beta(4.0, 4.0)),
        weight=float(rng.beta(3.0, 3.0)),
        height=float(np.clip(rng.normal(0.41, 0.10), 0.15, 0.66)),
        proportions=float(rng.uniform(0.2, 1.0)),
    )


def child(rng: np.random.Generator) -> Phenotype:
    """A random child of school age."""
    return Phenotype(
        gender=float(rng.uniform()),
        age=float(rng.uniform(0.24, 0.44)),
        muscle=float(rng.beta(4.0, 4.0)),
        weight=float(rng.beta(3.0, 3.0)),
        height=float(rng.uniform(0.3, 0.6)),
        proportions=float(rng.uniform(0.2, 1.0)),
    )


def joints_at_rest(body: Body) -> np.ndarray:
    """Heads of our bones [B, 3] in our axes: x ahead, y left, z up."""
    return turned(np.stack([body.head(anny_name(name)) for name in BONES]))


def turned(points: np.ndarray) -> np.ndarray:
    """From bodies that look along -y with the left at +x."""
    return np.stack([-points[..., 1], points[..., 0], points[..., 2]], axis=-1)


def _points(body: Body, corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Thinned vertices and then heads of the bones [V + B, 3] in our axes."""
    skin = np.einsum("vc,vcx->vx", shares, body.vertices[corners])
    return np.concatenate([turned(skin), joints_at_rest(body)])


def _thinned(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, ...]:
    """Fewer triangles [F, 3], and for each vertex of theirs the three corners and shares [V, 3]."""
    import bpy
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree
    from mathutils.geometry import barycentric_transform

    mesh = bpy.data.meshes.new("whole")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    item = bpy.data.objects.new("whole", mesh)
    bpy.context.scene.collection.objects.link(item)
    modifier = item.modifiers.new("Reduce", "DECIMATE")
    modifier.ratio, modifier.use_symmetry, modifier.symmetry_axis = DETAIL, True, "X"
    modifier.use_collapse_triangulate = True
    few = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    few.calc_loop_triangles()
    kept = np.array([triangle.vertices[:] for triangle in few.loop_triangles])
    tree = BVHTree.FromPolygons(vertices.tolist(), faces.tolist())
    corners, shares = [], []
    unit = [Vector(row) for row in np.eye(3).tolist()]
    for vertex in few.vertices:
        place, _, face, _ = tree.find_nearest(vertex.co)
        corner = faces[face]
        shares.append(barycentric_transform(place, *(Vector(vertices[c]) for c in corner), *unit))
        corners.append(corner)
    share = np.clip(np.array(shares, dtype=np.float64), 0.0, 1.0)
    bpy.data.objects.remove(item)
    return kept, np.array(corners), share / share.sum(axis=1, keepdims=True)


def _components(points: np.ndarray, grown: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Arrays of the shape space, and the error of every vertex of every body [N, V] in metres."""
    mean = points[grown].mean(axis=0)
    apart = (points - mean).reshape(len(points), -1)
    scores, sizes, rows = np.linalg.svd(apart, full_matrices=False)
    spread = sizes[:COMPONENTS] / np.sqrt(len(points))
    kept = (spread[:, None] * rows[:COMPONENTS]).astype(np.float16)
    own = scores[:, :COMPONENTS] * np.sqrt(len(points))
    # Taller is more, whatever sign the decomposition came with.
    tall = points[:, :, 2].max(axis=1)
    sign = np.where(np.corrcoef(own[:, 0], tall)[0, 1] < 0.0, -1.0, 1.0)
    kept[0], own[:, 0] = sign * kept[0], sign * own[:, 0]
    whole = mean.ravel() + own @ kept.astype(np.float64)
    error = np.linalg.norm(whole.reshape(points.shape) - points, axis=2)
    arrays = {
        "mean": mean.astype(np.float32),
        "components": kept.reshape(COMPONENTS, *mean.shape),
    }
    for name, who in (("adults", grown), ("children", ~grown)):
        arrays[f"{name}_middle"] = own[who].mean(axis=0).astype(np.float32)
        arrays[f"{name}_spread"] = np.linalg.cholesky(
            np.cov(own[who].T) + 1e-6 * np.eye(COMPONENTS)
        ).astype(np.float32)
    return arrays, error


def _skin(body: Body, corners: np.ndarray, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index and weight of the four bones that hold each vertex most, both [V, 4]."""
    merged = np.zeros((len(body.vertices), len(BONES)))
    starts = {anny_name(name): row for row, name in enumerate(BONES)}
    for column in range(len(body.bones)):
        above = column
        while body.bones[above] not in starts:
            above = body.parents[above]
        merged[:, starts[body.bones[above]]] += body.weights[:, column]
    weights = np.einsum("vc,vcb->vb", shares, merged[corners])
    bone = np.argsort(-weights, axis=1)[:, :4]
    weight = np.take_along_axis(weights, bone, axis=1)
    return bone, weight / weight.sum(axis=1, keepdims=True)
