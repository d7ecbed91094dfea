# SPDX-License-Identifier: Apache-2.0
"""The mesh z-buffer against a sphere in closed form and against the true masks of a dataset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from mesh_pictures import rasterize_mesh
from scipy.ndimage import maximum_filter, minimum_filter

from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsFormatError
from rfgs_core.render.view import camera_of


def test_sphere_has_its_closed_form_outline_and_planar_depth(camera) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    centre = np.array([0.2, -0.1, -2.0])
    eye = camera(size=(96, 80), focal=90.0)
    picture = rasterize_mesh(ball.vertices + centre, ball.faces, eye)
    row, column = np.mgrid[0:80, 0:96] + 0.5
    ray = np.stack([(column - 48) / 90, -(row - 40) / 90, -np.ones_like(row)], -1)
    a, b = (ray**2).sum(-1), ray @ centre
    discriminant = b * b - a * (centre @ centre - 0.25)
    hit = discriminant > 0
    assert hit.sum() > 1000
    # Only pixels on the outline may differ: the icosphere is inscribed by under 0.1 mm.
    assert (hit != picture.mask).sum() <= 0.02 * hit.sum()
    inside = discriminant > 0.02
    expected = (b - np.sqrt(np.where(inside, discriminant, 0.0))) / a
    # The ray has unit length along the axis, so its parameter is the planar depth.
    np.testing.assert_allclose(picture.depth[inside], expected[inside], atol=2e-3)
    assert np.isinf(picture.depth[~picture.mask]).all()


def test_nearer_triangle_wins_and_labels_follow_faces(camera) -> None:
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    vertices = np.concatenate([square - [0, 0, 4], 0.5 * square - [0, 0, 2]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]])  # the near one seen from behind
    picture = rasterize_mesh(vertices, faces, camera(size=(32, 32), focal=40.0))
    labels = picture.labels(np.array([7, 7, 9, 9]))
    # Both squares fill exactly 20 x 20 pixels in the middle.
    assert (labels == 9).sum() == 400
    assert set(np.unique(labels)) == {0, 9}
    np.testing.assert_allclose(picture.depth[picture.mask], 2.0, rtol=1e-6)


def test_triangle_through_the_near_plane_is_cut(camera) -> None:
    # A floor 1 m below that runs from far behind the camera to far in front.
    floor = np.array([[-50, -1, 50], [50, -1, 50], [50, -1, -50], [-50, -1, -50]], float)
    eye = camera(size=(32, 24), focal=20.0)
    picture = rasterize_mesh(floor, np.array([[0, 1, 2], [0, 2, 3]]), eye)
    row = np.arange(24) + 0.5
    expected = np.where(row > 12, 20.0 / np.maximum(row - 12, 1e-9), np.inf)
    seen = expected < 50
    np.testing.assert_allclose(picture.depth[seen, 16], expected[seen], rtol=1e-5)
    assert not picture.mask[:12].any()


def test_no_cracks_between_triangles(camera) -> None:
    n = 21
    x, y = np.meshgrid(np.linspace(-2, 2, n), np.linspace(-2, 2, n))
    vertices = np.stack([x, y, -3.0 + 0.1 * np.sin(5 * x)], -1).reshape(-1, 3)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)])
    picture = rasterize_mesh(vertices, faces, camera(size=(64, 64), focal=64.0))
    assert picture.mask.all()


def test_empty_mesh_and_bad_meshes(camera) -> None:
    eye = camera()
    empty = rasterize_mesh(np.zeros((0, 3)), np.zeros((0, 3), int), eye)
    assert not empty.mask.any()
    with pytest.raises(RfgsFormatError, match="name vertices"):
        rasterize_mesh(np.zeros((2, 3)), np.array([[0, 1, 2]]), eye)
    with pytest.raises(RfgsFormatError, match="not finite"):
        rasterize_mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]]), eye)


def test_true_mesh_matches_the_masks_of_the_dataset(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    for frame in sequence.frames:
        vertices, faces, instance = sequence.moving_mesh(frame)
        for row in sequence.cameras:
            eye = camera_of(sequence, row["name"])
            drawn = rasterize_mesh(vertices, faces, eye).labels(instance)
            true = sequence.mask(row["name"], frame)
            assert true.any()
            near_border = maximum_filter(true, 3) != minimum_filter(true, 3)
            wrong = (drawn != true) & ~near_border
            assert not wrong.any()
