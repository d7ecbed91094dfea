# SPDX-License-Identifier: Apache-2.0
"""The ceiling baseline starts on the true surface and nowhere else."""

from __future__ import annotations

import numpy as np

from rfgs_core.evaluate.geometry import surface_samples


def test_samples_lie_on_the_mesh_in_proportion_to_area_with_outward_normals():
    vertices = np.array([[0, 0, 1], [2, 0, 1], [0, 2, 1], [5, 0, 0], [5, 1, 0], [5, 0, 1]], "f4")
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    points, normals = surface_samples(vertices, faces, 20_000, np.random.default_rng(0))
    large = points[:, 0] < 4
    assert abs(large.mean() - 2.0 / 2.5) < 0.01
    np.testing.assert_allclose(points[large, 2], 1.0)
    assert (points[large, :2].sum(axis=1) <= 2 + 1e-9).all()
    assert (points[large, :2] >= 0).all()
    np.testing.assert_allclose(points[large].mean(axis=0), [2 / 3, 2 / 3, 1], atol=0.02)
    np.testing.assert_allclose(normals[large], [[0, 0, 1]] * int(large.sum()), atol=1e-6)
    np.testing.assert_allclose(normals[~large], [[1, 0, 0]] * int((~large).sum()), atol=1e-6)
