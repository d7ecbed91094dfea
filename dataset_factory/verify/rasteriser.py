# SPDX-License-Identifier: Apache-2.0
"""One ray through the centre of each pixel against all triangles, in NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dataset_factory.scene.bundle import Bundle
from dataset_factory.verify.description import Camera

#: Rays per block, which bounds memory.
_BLOCK = 512


@dataclass(frozen=True)
class Raster:
    """What a camera sees."""

    depth: np.ndarray
    """Planar depth [m], infinite where nothing is hit, shape (h, w)."""
    normal: np.ndarray
    """Unit normals of the triangles in world axes, towards the camera, shape (h, w, 3)."""
    instance: np.ndarray
    """Instance id, 0 for what stands still, shape (h, w)."""
    inner: np.ndarray
    """Whether the pixel and its eight neighbours see one plane of one mesh, bool, (h, w)."""


def raster(bundle: Bundle, camera: Camera, frame: int, size_px: int) -> Raster:
    """Casts rays into the exported geometry.

    Args:
        bundle: Scene bundle.
        camera: As described, not as exported.
        frame: Which frame.
        size_px: Width and height of the picture [px].
    """
    corners, instance, mesh = _triangles(bundle, frame)
    axes = _axes(camera)
    half = np.tan(np.radians(camera.angle_deg) / 2)
    at = (2.0 * (np.arange(size_px) + 0.5) / size_px - 1.0) * half
    x, y = np.meshgrid(at, -at)
    # Planar depth is along the third axis, so rays have length 1 along it.
    ways = x[..., None] * axes[0] + y[..., None] * axes[1] + axes[2]
    depth, hit = _nearest(np.array(camera.at), ways.reshape(-1, 3), corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    seen = normal[hit]
    seen *= np.where(np.sum(seen * ways.reshape(-1, 3), axis=1) > 0.0, -1.0, 1.0)[:, None]
    shape = (size_px, size_px)
    plane = np.concatenate([mesh[hit][:, None], seen], axis=1).reshape(*shape, 4)
    plane[~np.isfinite(depth.reshape(shape))] = -9.0
    return Raster(
        depth=depth.reshape(shape),
        normal=seen.reshape(*shape, 3),
        instance=np.where(np.isfinite(depth), instance[hit], 0).reshape(shape),
        inner=_inner(plane) & np.isfinite(depth.reshape(shape)),
    )


def _triangles(bundle: Bundle, frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners [m], shape (T, 3, 3), instance and mesh of all triangles at a frame."""
    moving = bundle.frame(frame).vertices[bundle.topology.faces]
    parts = [moving.astype(np.float64)]
    instance = [bundle.topology.instance]
    mesh = [-bundle.topology.instance]
    for index, still in enumerate(bundle.static_meshes()):
        parts.append(still.vertices[still.faces].astype(np.float64))
        instance.append(np.zeros(len(still.faces), np.int32))
        mesh.append(np.full(len(still.faces), index + 1))
    return np.concatenate(parts), np.concatenate(instance), np.concatenate(mesh)


def _axes(camera: Camera) -> np.ndarray:
    """Right, up and forward of an upright camera, rows of shape (3, 3)."""
    forward = np.array(camera.to) - np.array(camera.at)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def _nearest(
    origin: np.ndarray, ways: np.ndarray, corners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Multiple of each way at its first hit, infinite if none, and the triangle that is hit.

    A triangle is hit where all three edge functions agree in sign.
    """
    a, b, c = (corners[:, n] - origin for n in range(3))
    # Edge functions are linear in the way: w · (b × c) and so on, over their sum.
    edges = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    volume = np.einsum("tx,tx->t", a, edges[0])
    depth, hit = np.full(len(ways), np.inf), np.zeros(len(ways), dtype=np.int64)
    for first in range(0, len(ways), _BLOCK):
        block = ways[first : first + _BLOCK]
        inside = np.einsum("etx,rx->ert", edges, block)
        total = inside.sum(axis=0)
        same = (inside >= 0.0).all(axis=0) | (inside <= 0.0).all(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = np.where(same & (np.abs(total) > 1e-14), volume / total, np.inf)
        along[along <= 1e-6] = np.inf
        hit[first : first + _BLOCK] = along.argmin(axis=1)
        depth[first : first + _BLOCK] = along.min(axis=1)
    return depth, hit


def _inner(plane: np.ndarray) -> np.ndarray:
    """Whether each pixel's plane, shape (h, w, 4), is that of its eight neighbours."""
    inner = np.zeros(plane.shape[:2], dtype=bool)
    inner[1:-1, 1:-1] = True
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            other = np.roll(plane, (down, right), axis=(0, 1))
            inner &= np.abs(other - plane).max(axis=2) < 1e-4
    return inner
