# SPDX-License-Identifier: Apache-2.0
"""Pictures, panoramas and hierarchies against every triangle tried for every ray."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from rfgs_core.errors import RfgsError
from rfgs_core.simulate.geometry import faces_of
from rfgs_core.simulate.geometry.bvh import build_bvh, refit
from rfgs_core.simulate.geometry.rays import blocked, nearest, new_stack
from rfgs_core.simulate.geometry.room import Room, SlabMaterial, box_room, empty_room
from rfgs_core.simulate.sight.bodies import HIDDEN, SEEN, hides, picture
from rfgs_core.simulate.sight.panorama import panorama, sees

PLACE = np.array([0.1, -2.4, 0.9])


def scene() -> trimesh.Trimesh:
    """A ball, a stick before it and a sheet beside."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    stick = trimesh.creation.cylinder(radius=0.05, height=1.8, sections=12)
    stick.apply_translation([0.2, -1.0, 0.2])
    sheet = trimesh.creation.box([0.6, 0.01, 1.0])
    sheet.apply_translation([-0.7, -0.4, 0.1])
    return trimesh.util.concatenate([ball, stick, sheet])


def rays_met(triangles: np.ndarray, start: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Nearest share of the way to each end at which any triangle is met; 2 for none."""
    a, u, v = triangles[:, 0], *(triangles[:, i] - triangles[:, 0] for i in (1, 2))
    out = np.full(len(ends), 2.0)
    for i, way in enumerate(ends - start):
        p = np.cross(way, v)
        det = np.einsum("tx,tx->t", u, p)
        det = np.where(det == 0.0, 1e-300, det)
        s = start - a
        q = np.cross(s, u)
        share = np.einsum("tx,tx->t", v, q) / det
        b, c = np.einsum("tx,tx->t", s, p) / det, q @ way / det
        met = (b >= 0) & (c >= 0) & (b + c <= 1) & (share > 1e-9)
        out[i] = share[met].min(initial=2.0)
    return out


def test_pictures_never_err() -> None:
    """What a picture calls seen or hidden is so; rays decide the rest."""
    mesh = scene()
    triangles = np.asarray(mesh.triangles)
    drawn = picture(np.asarray(mesh.vertices), np.asarray(mesh.faces), PLACE, np.zeros(3), 1.6, 192)
    points, index = trimesh.sample.sample_surface(mesh, 1500, seed=0)
    points = points + 1e-3 * mesh.face_normals[index]
    share = rays_met(triangles, PLACE, points)
    bvh, stack = build_bvh(triangles), new_stack()
    said = np.array([hides(drawn, triangles, point) for point in points])
    assert not (share[said == SEEN] < 1.0 - 3e-3).any()
    assert (share[said == HIDDEN] < 1.0).all()
    assert (said == SEEN).sum() > 300 and (said == HIDDEN).sum() > 300
    hidden = np.array([blocked(bvh, PLACE, point, 1e-6, stack) for point in points])
    np.testing.assert_array_equal(hidden, share < 1.0)


def test_a_refitted_hierarchy_meets_what_has_moved() -> None:
    rng = np.random.default_rng(3)
    triangles = np.asarray(scene().triangles)
    moved = triangles @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    bvh, fresh, stack = refit(build_bvh(triangles), moved), build_bvh(moved), new_stack()
    ends = moved.mean(axis=(0, 1)) + rng.normal(size=(400, 3))
    share = rays_met(moved, PLACE, ends)
    for tree in (bvh, fresh):
        found = [blocked(tree, PLACE, end, 1e-6, stack) for end in ends]
        np.testing.assert_array_equal(found, share < 1.0)
    lengths = np.linalg.norm(ends - PLACE, axis=1)
    for end, length, at in zip(ends, lengths, share, strict=True):
        got, index = nearest(bvh, PLACE, (end - PLACE) / length, 1e-6, stack)
        if at < 1.0:
            assert index >= 0 and abs(got - at * length) < 1e-6


def test_a_panorama_sees_what_rays_see() -> None:
    furniture = np.concatenate([scene().triangles, box_triangles()])
    faces = faces_of(furniture, np.zeros(len(furniture), dtype=np.int64))
    around, stack = panorama(faces, PLACE, 256), new_stack()
    points = np.random.default_rng(4).uniform(-1.9, 1.9, size=(2000, 3))
    found = np.array([sees(around, faces.bvh, point, stack) for point in points])
    share = rays_met(furniture, PLACE, points)
    # Only what is narrower than a pixel may be overlooked.
    assert (found != (share > 1.0)).mean() < 1e-3


def box_triangles() -> np.ndarray:
    return box_room(np.full(3, -3.0), np.full(3, 3.0), SlabMaterial("concrete", 0.2)).triangles


def test_wrong_rooms_get_one_line() -> None:
    with pytest.raises(RfgsError, match="lower corner below the upper"):
        box_room(np.zeros(3), np.array([1.0, 0.0, 1.0]), SlabMaterial("concrete", 0.2))
    with pytest.raises(RfgsError, match=r"unobtainium: expected one of concrete"):
        box_room(np.zeros(3), np.ones(3), SlabMaterial("unobtainium", 0.2))
    corners = np.zeros((1, 3, 3))
    corners[0, 1, 2] = np.nan
    index = np.zeros(1, dtype=np.int64)
    with pytest.raises(RfgsError, match="triangle 0 has a corner that is not a finite number"):
        Room(corners, index, index, (SlabMaterial("wood", 0.03),), "here")
    assert len(empty_room().faces.normal) == 0
