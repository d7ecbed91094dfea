# SPDX-License-Identifier: Apache-2.0
"""Pinhole cameras: where a point of the world lands in a picture.

A dataset gives `world_from_camera` with OpenGL axes (+X right, +Y up, −Z forward). Rendering uses
view axes (+x right, +y down, +z forward), so that z is the planar depth and rows grow with y.
Pixel (row r, column c) covers [c, c+1] × [r, r+1]; its centre is (c + 0.5, r + 0.5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Float64

from rfgs_core.errors import RfgsFormatError

#: View axes from OpenGL camera axes.
_FLIP = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Camera:
    """One pinhole camera with square or oblong pixels and no distortion."""

    name: str
    """Name in the dataset, for example cam00."""
    width: int
    """Columns of the picture [px]."""
    height: int
    """Rows of the picture [px]."""
    fl_x: float
    """Focal length along a row [px]."""
    fl_y: float
    """Focal length along a column [px]."""
    cx: float
    """Column of the optical axis [px]; width / 2 for a centred one."""
    cy: float
    """Row of the optical axis [px]."""
    world_from_camera: Float64[np.ndarray, "4 4"]
    """Position and rotation, OpenGL axes."""

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> Camera:
        """The camera that a dataset's `sequence.json` describes.

        Raises:
            RfgsFormatError: A key is missing, or the numbers are no rigid pinhole camera.
        """
        try:
            camera = Camera(
                name=str(values["name"]),
                width=int(values["width"]),
                height=int(values["height"]),
                fl_x=float(values["fl_x"]),
                fl_y=float(values["fl_y"]),
                cx=float(values["cx"]),
                cy=float(values["cy"]),
                world_from_camera=np.asarray(values["world_from_camera"], dtype=np.float64),
            )
        except KeyError as error:
            raise RfgsFormatError(
                f"camera {values.get('name', '?')}: {error.args[0]!r} is missing"
            ) from error
        except (TypeError, ValueError) as error:
            raise RfgsFormatError(f"camera {values.get('name', '?')}: {error}") from error
        camera._check()
        return camera

    @property
    def position_m(self) -> Float64[np.ndarray, "3"]:
        """Centre of projection in the world [m]."""
        return self.world_from_camera[:3, 3]

    @property
    def view_from_world(self) -> Float64[np.ndarray, "4 4"]:
        """Takes world points to view axes (+x right, +y down, +z forward)."""
        rotation = _FLIP @ self.world_from_camera[:3, :3].T
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = rotation @ -self.position_m
        return matrix

    def to_view(self, points: Float[np.ndarray, "N 3"]) -> Float64[np.ndarray, "N 3"]:
        """World points in view axes [m]; the third coordinate is the planar depth."""
        matrix = self.view_from_world
        return np.asarray(points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]

    def project(
        self, points: Float[np.ndarray, "N 3"]
    ) -> tuple[Float64[np.ndarray, "N 2"], Float64[np.ndarray, "N"]]:
        """Where world points land.

        Args:
            points: World coordinates [m], shape [N, 3].

        Returns:
            Pixel coordinates (column, row), shape [N, 2], NaN for points that are not in front of
            the camera, and planar depths [m], shape [N], negative behind the camera.
        """
        view = self.to_view(points)
        depth = np.where(np.greater(view[:, 2], 0.0), view[:, 2], np.nan)
        column = self.fl_x * view[:, 0] / depth + self.cx
        row = self.fl_y * view[:, 1] / depth + self.cy
        return np.stack([column, row], axis=-1), view[:, 2]

    def scaled(self, factor: float) -> Camera:
        """The same camera taking pictures `factor` times as large."""
        width, height = round(self.width * factor), round(self.height * factor)
        if min(width, height) < 1:
            raise RfgsFormatError(f"camera {self.name}: factor {factor} leaves no pixel")
        along_x, along_y = width / self.width, height / self.height
        return Camera(
            name=self.name,
            width=width,
            height=height,
            fl_x=self.fl_x * along_x,
            fl_y=self.fl_y * along_y,
            cx=self.cx * along_x,
            cy=self.cy * along_y,
            world_from_camera=self.world_from_camera,
        )

    def _check(self) -> None:
        numbers = [self.fl_x, self.fl_y, self.cx, self.cy]
        matrix = self.world_from_camera
        if matrix.shape != (4, 4):
            raise RfgsFormatError(
                f"camera {self.name}: world_from_camera has shape {matrix.shape}, expected (4, 4)"
            )
        if not (np.isfinite(numbers).all() and np.isfinite(matrix).all()):
            raise RfgsFormatError(f"camera {self.name}: a number is not finite")
        if min(self.width, self.height) < 1 or min(self.fl_x, self.fl_y) <= 0.0:
            raise RfgsFormatError(
                f"camera {self.name}: size {self.width}×{self.height}, focal lengths "
                f"{self.fl_x}, {self.fl_y} px; expected positive numbers"
            )
        rotation = matrix[:3, :3]
        skew = np.abs(rotation @ rotation.T - np.eye(3)).max()
        if skew > 1e-4 or np.linalg.det(rotation) < 0.0:
            raise RfgsFormatError(
                f"camera {self.name}: world_from_camera holds no rotation; remove the scale of "
                "the camera object"
            )
