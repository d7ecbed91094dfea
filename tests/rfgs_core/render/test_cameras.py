# SPDX-License-Identifier: Apache-2.0
"""Camera conventions against points placed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.errors import RfgsFormatError
from rfgs_core.render.cameras import Camera


def test_hand_made_points_land_where_opengl_axes_say(camera) -> None:
    eye = camera(size=(32, 24), focal=40.0)
    points = np.array([[0.0, 0.0, -2.0], [0.5, 0.0, -2.0], [0.0, 0.5, -2.0], [0.0, 0.0, 2.0]])
    pixels, depth = eye.project(points)
    # On the axis; to the right; up means a smaller row; behind the camera means nowhere.
    np.testing.assert_allclose(pixels[:3], [[16, 12], [26, 12], [16, 2]], atol=1e-12)
    np.testing.assert_allclose(depth, [2.0, 2.0, 2.0, -2.0], atol=1e-12)
    assert np.isnan(pixels[3]).all()


def test_camera_looking_along_y_with_z_up(camera) -> None:
    # Columns: camera right, up and backward in the world; the camera stands at (1, 2, 3).
    pose = np.array([[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]], float)
    eye = camera(world_from_camera=pose.tolist(), cx=10.0, cy=8.0)
    pixels, depth = eye.project(np.array([[1.0, 6.0, 3.0], [2.0, 6.0, 4.0]]))
    np.testing.assert_allclose(pixels, [[10, 8], [20, -2]], atol=1e-12)
    np.testing.assert_allclose(depth, 4.0)


def test_scaled_camera_sees_the_same(camera) -> None:
    eye = camera(size=(32, 24))
    points = np.array([[0.3, -0.2, -1.5]])
    large, _ = eye.scaled(3.0).project(points)
    small, _ = eye.project(points)
    np.testing.assert_allclose(large, 3.0 * small)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fl_x": -1.0}, "positive"),
        ({"width": 0}, "positive"),
        ({"cx": float("nan")}, "not finite"),
        ({"world_from_camera": np.diag([2.0, 2.0, 2.0, 1.0]).tolist()}, "scale"),
        ({"world_from_camera": np.diag([-1.0, 1.0, 1.0, 1.0]).tolist()}, "rotation"),
        ({"world_from_camera": [[1.0]]}, "shape"),
        ({"height": "tall"}, "tall"),
    ],
)
def test_impossible_cameras_are_refused(camera, changes: dict, message: str) -> None:
    with pytest.raises(RfgsFormatError, match=message):
        camera(**changes)


def test_missing_key_is_named() -> None:
    with pytest.raises(RfgsFormatError, match="'fl_x' is missing"):
        Camera.from_dict({"name": "cam00", "width": 4, "height": 4})
